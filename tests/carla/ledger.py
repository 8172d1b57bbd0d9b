"""The ledger: which members of CARLA's Python API were used, and what was observed."""

import json
import time
import traceback

import members

REGISTERED = []
ROWS = {}
LISTED = members.in_list()
USES = members.Uses()
# Rows of blueprints and of attributes that have no member in the package.
BLUEPRINTS = ("sensor.", "static.", "util.", "vehicle.", "walker.", "sensor_tick", "sticky_control")


def check(function):
    """Registers a check, which calls members, observes effects, and enters members."""
    REGISTERED.append(function)
    return function


def member_of(name):
    """Returns the member that a row is about: a row may name a case of it, as in `a:b` or `a=b`."""
    return name.split(":")[0].split("=")[0]


def enter(verdict, names, note):
    of = {name: member_of(name) for name in names.split()}
    unknown = [one for one in of.values() if one not in LISTED and not one.startswith(BLUEPRINTS)]
    assert not unknown, f"no members: {unknown}"
    # A row is not entered for a member that the check has not used.
    unused = [one for one in of.values() if one in USES.visible and one not in USES.seen]
    assert not unused, f"not used: {unused}"
    ROWS.update({name: (verdict, note) for name in of})


def works(names, effect):
    """Enters members whose effect is CARLA's own; `effect` describes what was observed."""
    enter("works", names, effect)


def differs(names, how):
    """Enters members whose effect differs from CARLA's; `how` describes the difference."""
    enter("differs", names, how)


def local(names, note):
    """Enters members that the package computes itself; `note` describes what was computed."""
    enter("local", names, note)


def refuses(words, calls, note=None):
    """Enters members whose calls raise an error that contains `words`.

    The note is the text of the error, unless another one is given.
    """
    for member, call in calls.items():
        try:
            call()
        except Exception as error:  # The package raises RuntimeError and types of its own.
            assert words in str(error), f"{member}: {error!r} does not contain {words!r}"
            enter("error", member, note or str(error).strip())
            continue
        raise AssertionError(f"{member}: no error")


def ignored(words, calls):
    """Enters members whose calls succeed without effect; the simulator logs the reason."""
    for member, call in calls.items():
        call()
        enter("nothing", member, words)


def section(name):
    """Returns the heading of a row: its class, or "Blueprints"."""
    member = member_of(name)
    if member not in LISTED:
        return "Blueprints"
    return member.rpartition(".")[0] if LISTED[member] != "constructor" else member


def run(context, checks):
    """Runs the checks in order; prints one JSON line for each member and for each failure."""
    failures = []
    connected = set(USES.seen)
    for function in checks:
        USES.seen.clear()
        USES.seen.update(connected)
        begun = time.monotonic()
        try:
            function(context)
        except Exception:
            failures.append(f"{function.__name__}\n{traceback.format_exc()}")
        print(f"{function.__name__}: {time.monotonic() - begun:.1f} s")
    missing = [function.__name__ for function in REGISTERED if function not in checks]
    if missing:
        failures.append(f"checks that are registered but not run: {missing}")
    without = sorted(LISTED.keys() - ROWS.keys())
    if without:
        failures.append(f"{len(without)} members without a row: {' '.join(without)}")
    for name, (verdict, note) in sorted(ROWS.items(), key=lambda row: (section(row[0]), row[0])):
        print(json.dumps(
            {"class": section(name), "member": name, "verdict": verdict, "note": note}))
    for failure in failures:
        print(json.dumps({"failure": failure}))
    return not failures
