"""The members of CARLA's Python API: the list, what the package has, and which ones were used.

`python members.py` compares the list with the package. `python members.py --write` renews it from
the package; what only CARLA's documentation has is kept.
"""

import inspect
import pathlib
import sys
import types

import carla

LIST = pathlib.Path(__file__).with_name("members.txt")
HEAD = """\
# Every member of the `carla` 0.9.16 package, and its kind: `members.py` compares the list with the
# package and renews it. `documented` marks what CARLA's documentation has and the package lacks.
"""
# What Python and Boost.Python give to each class.
PYTHON_S_OWN = set("""
    __module__ __doc__ __dict__ __weakref__ __instance_size__ __reduce__ __slots__
    __getstate__ __safe_for_unpickling__ __qualname__ __hash__""".split())
ENUM = carla.TrafficLightState.__mro__[1]


def classes():
    """Yields the name and the class of each class of the package."""
    for prefix, module in (("", carla), ("command.", carla.command)):
        for name, value in sorted(vars(module).items()):
            if inspect.isclass(value):
                yield prefix + name, value


def members_of(cls):
    """Yields the name, the kind and the value of each member that the class itself defines."""
    if issubclass(cls, ENUM):
        for name, value in sorted(cls.names.items(), key=lambda one: (int(one[1]), one[0])):
            yield name, f"enum {int(value)}", value
        return
    for name, value in vars(cls).items():
        if name in PYTHON_S_OWN or type(value) is types.BuiltinFunctionType:
            continue
        if type(value) is property:
            kind = "property" if value.fset else "property ro"
        elif isinstance(value, staticmethod):
            kind = "static"
        elif name == "__init__":
            kind = "constructor"
        elif callable(value):
            kind = "operator" if name.startswith("__") else "method"
        else:
            kind = "constant"
        yield name, kind, value


def full(owner, name):
    """Returns the name of a member in the list: that of a constructor is the class."""
    return owner if name == "__init__" else f"{owner}.{name}"


def in_package():
    """Returns the kind of each member of the package, by its name."""
    found = {full(owner, name): kind
             for owner, cls in classes() for name, kind, _ in members_of(cls)}
    found["command.FutureActor"] = "constant"
    return found


def in_list():
    """Returns the kind of each member of the list, by its name."""
    lines = [line for line in LIST.read_text().splitlines() if line and line[0] != "#"]
    return dict(line.split(": ") for line in lines)


class Uses:
    """Which members have been used: every method, operator and property of the package is wrapped.

    A keyword of a constructor is a use of the property of its name. Uses of enum values and
    constants cannot be seen.
    """

    def __init__(self):
        self.seen = set()
        self.visible = set()
        for owner, cls in classes():
            for name, kind, value in list(members_of(cls)):
                member = full(owner, name)
                if kind in ("constructor", "method", "operator"):
                    setattr(cls, name, self.wrapped(member, value))
                elif kind == "static":
                    setattr(cls, name, staticmethod(self.wrapped(member, value.__func__)))
                elif type(value) is property:
                    setattr(cls, name, property(
                        self.wrapped(member, value.fget),
                        value.fset and self.wrapped(member, value.fset)))
                else:
                    continue
                self.visible.add(member)

    def wrapped(self, member, function):
        seen = self.seen

        def call(*arguments, **named):
            seen.add(member)
            seen.update(f"{member}.{name}" for name in named)
            return function(*arguments, **named)
        return call


def write():
    kept = {name: kind for name, kind in in_list().items() if kind == "documented"} \
        if LIST.exists() else {}
    lines = [f"{name}: {kind}\n" for name, kind in sorted((kept | in_package()).items())]
    LIST.write_text(HEAD + "".join(lines))


def compare():
    """Returns what differs between the list and the package."""
    listed = {name: kind for name, kind in in_list().items() if kind != "documented"}
    package = in_package()
    return [f"{name}: the list says {listed.get(name)}, the package {package.get(name)}"
            for name in sorted(listed.keys() | package.keys())
            if listed.get(name) != package.get(name)]


if __name__ == "__main__":
    if "--write" in sys.argv:
        write()
    differences = compare()
    print("\n".join(differences) or f"{len(in_list())} members")
    sys.exit(bool(differences))
