"""Which members of CARLA's Python API were called through the official package, with what effect."""

import json
import traceback

CHECKS = []
ROWS = {}


def check(function):
    """A check: it calls members, observes effects, and enters members into the ledger."""
    CHECKS.append(function)
    return function


def enter(verdict, members, note):
    for member in members.split():
        ROWS[member] = (verdict, note)


def works(members, effect):
    """These members did what CARLA does; `effect` says what was observed."""
    enter("works", members, effect)


def differs(members, how):
    """These members do something, but not quite what CARLA does."""
    enter("differs", members, how)


def refuses(words, calls):
    """Each call raises CARLA's error with these words."""
    for member, call in calls.items():
        try:
            call()
        except Exception as error:  # The package raises RuntimeError and its own kinds.
            assert words in str(error), f"{member}: {error!r} does not say {words!r}"
            enter("error", member, str(error).strip())
            continue
        raise AssertionError(f"{member}: no error")


def ignored(words, calls):
    """The client waits for no answer to these; nothing happens, and the log says why."""
    for member, call in calls.items():
        call()
        enter("nothing", member, words)


def run(context):
    """All checks in order; one JSON line for each member, and the failures."""
    failures = []
    for function in CHECKS:
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
