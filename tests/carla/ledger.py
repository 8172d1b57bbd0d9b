"""The ledger: which members of CARLA's Python API were called, and what was observed."""

import json
import traceback

REGISTERED = []
ROWS = {}


def check(function):
    """Registers a check, which calls members, observes effects, and enters members."""
    REGISTERED.append(function)
    return function


def enter(verdict, members, note):
    for member in members.split():
        ROWS[member] = (verdict, note)


def works(members, effect):
    """Enters members whose effect is CARLA's own; `effect` describes what was observed."""
    enter("works", members, effect)


def differs(members, how):
    """Enters members whose effect differs from CARLA's; `how` describes the difference."""
    enter("differs", members, how)


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


def run(context, checks):
    """Runs the checks in order; prints one JSON line for each member and for each failure."""
    missing = [function.__name__ for function in REGISTERED if function not in checks]
    failures = [f"checks that are registered but not run: {missing}"] if missing else []
    for function in checks:
        try:
            function(context)
        except Exception:
            failures.append(f"{function.__name__}\n{traceback.format_exc()}")
    for member in sorted(ROWS):
        verdict, note = ROWS[member]
        print(json.dumps({"member": member, "verdict": verdict, "note": note}))
    for failure in failures:
        print(json.dumps({"failure": failure}))
    return not failures
