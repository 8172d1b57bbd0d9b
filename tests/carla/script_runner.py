"""Runs one of CARLA's scripts unmodified, without a screen, with simulated key presses.

Usage: script_runner.py PORT SECONDS KEYS SCRIPT [ARGUMENT...]. Connections to port 2000 go to PORT;
KEYS are pressed one after the other (`w*40` holds one for 40 polls of events); after SECONDS the
window is closed, and two seconds later the script is interrupted.
"""

import os
import runpy
import signal
import sys
import threading
import time

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
os.environ.setdefault("SDL_AUDIODRIVER", "dummy")
os.environ.setdefault("MPLBACKEND", "Agg")

import carla
import numpy

# The scripts were written for numpy 1.18.
numpy.int = int


CLIENTS = []


def main():
    port, seconds, keys, script = int(sys.argv[1]), float(sys.argv[2]), sys.argv[3], sys.argv[4]
    sys.argv = sys.argv[4:]
    sys.path.insert(0, os.path.dirname(os.path.abspath(script)))
    redirect(port)
    end = time.monotonic() + seconds
    if "pygame" in open(script, encoding="utf-8").read():
        press(keys, end)
    threading.Thread(target=interrupt, args=(end + 2.0,), daemon=True).start()
    code = 0
    try:
        runpy.run_path(script, run_name="__main__")
    except KeyboardInterrupt:
        print("script runner: interrupted")
    except SystemExit as leave:
        code = leave.code if isinstance(leave.code, int) else int(leave.code is not None)
        if code or isinstance(leave.code, str):
            print(f"script runner: exit {leave.code}", file=sys.stderr)
    except BaseException:
        import traceback
        traceback.print_exc()
        code = 1
    sys.stdout.flush()
    sys.stderr.flush()
    # The package sometimes aborts while its threads end.
    os._exit(code)


def redirect(port):
    """Redirects connections to CARLA's default port to this one."""
    connect = carla.Client

    def client(host="127.0.0.1", wanted=2000, *more, **named):
        wanted = named.pop("port", wanted)
        made = connect(named.pop("host", host), port if wanted == 2000 else wanted, *more, **named)
        # The package may abort if an object outlives its client, so clients are kept to the end.
        CLIENTS.append(made)
        return made

    carla.Client = client


def interrupt(at):
    time.sleep(max(0.0, at - time.monotonic()))
    for _ in range(5):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(2.0)


def press(keys, end):
    """Sends events to the window: key presses, and at the end the request to close it."""
    import pygame

    script = []
    for word in keys.split(",") if keys != "-" else []:
        name, _, times = word.partition("*")
        shift = name.startswith("shift+")
        key = pygame.key.key_code(name.removeprefix("shift+"))
        script.append((key, pygame.KMOD_SHIFT if shift else 0, int(times or 1)))
    get, pressed, mods = pygame.event.get, pygame.key.get_pressed, pygame.key.get_mods
    state = {"polls": 0, "held": None, "left": 0, "mods": 0}

    def events(*arguments, **named):
        found = list(get(*arguments, **named))
        state["polls"] += 1
        if time.monotonic() > end:
            return found + [pygame.event.Event(pygame.QUIT)]
        # Images should have arrived before the first key press.
        if state["polls"] < 10:
            return found
        if state["left"] > 0:
            state["left"] -= 1
            return found
        if state["held"] is not None:
            found.append(pygame.event.Event(pygame.KEYUP, key=state["held"], mod=state["mods"]))
            state["held"] = None
        elif script:
            key, modifiers, polls = script.pop(0)
            state.update(held=key, left=polls, mods=modifiers)
            found.append(pygame.event.Event(pygame.KEYDOWN, key=key, mod=modifiers, unicode=""))
        return found

    class Held:
        def __init__(self, real):
            self.real = real

        def __getitem__(self, key):
            return key == state["held"] or self.real[key]

    pygame.event.get = events
    pygame.key.get_pressed = lambda: Held(pressed())
    pygame.key.get_mods = lambda: state["mods"] if state["held"] is not None else mods()


if __name__ == "__main__":
    main()
