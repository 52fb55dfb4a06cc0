"""The modules of firmware/core call each other in one direction only: no circle among their object files.

    modules.py NM LIBRARY.a
"""

import re
import subprocess
import sys


def modules(nm, library):
    """What each object defines and what it needs of others."""
    text = subprocess.run([nm, library], check=True, capture_output=True, text=True).stdout
    defined, needed = {}, {}
    name = None
    for line in text.splitlines():
        if member := re.match(r"(\w+)\.c\.o\w*:$", line):
            name = member[1]
            needed[name] = set()
        elif symbol := re.match(r"[0-9a-f ]{16} ([A-Za-z]) (bushd_\w+)$", line):
            if symbol[1] == "U":
                needed[name].add(symbol[2])
            elif symbol[1].isupper():
                defined[symbol[2]] = name
    return {name: {defined[s] for s in symbols if s in defined} - {name} for name, symbols in needed.items()}


def circle(graph):
    """The names along one, or None."""
    done = set()

    def walk(name, path):
        if name in path:
            return path[path.index(name):] + [name]
        if name in done:
            return None
        for other in sorted(graph[name]):
            if found := walk(other, path + [name]):
                return found
        done.add(name)
        return None

    for name in sorted(graph):
        if found := walk(name, []):
            return found
    return None


def main(nm, library):
    graph = modules(nm, library)
    assert len(graph) >= 15 and "stream" in graph["stop"], f"{library}: not read as expected: {sorted(graph)}"
    found = circle(graph)
    assert not found, " -> ".join(found)
    print(f"{len(graph)} modules, {sum(map(len, graph.values()))} ways from one to another, no circle")


if __name__ == "__main__":
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"a"}}) == ["a", "b", "c", "a"]
    main(*sys.argv[1:])
