"""Commands of templates: `bushctl move [--wait] NAME DISTANCE [NAME DISTANCE...]` stands for several."""

import itertools
import re


class NoWord(Exception):
    pass


def alternatives(text):
    """`--speed F | --acceleration F` are two."""
    parts = re.split(r" \| (?=--)", text)
    if len(parts) > 1:
        head = parts[0].rsplit(" --", 1)[0]
        return [parts[0], *(f"{head} {part}" for part in parts[1:])]
    return [text]


def without_brackets(text):
    """What may be left out is; of `coarse|fine` the first."""
    text = re.sub(r"\b([a-z]+)\|[a-z|]+", r"\1", text)
    while "[" in text:
        text = re.sub(r" ?\[[^\[\]]*\]", "", text)
    return text


def with_brackets(text):
    """What may be left out is there, once; of `coarse|fine` the last."""
    text = re.sub(r"\[([^\[\]]* [^\[\]]*)\.\.\.\]", r"\1", text)
    text = re.sub(r"\b[a-z|]+\|([a-z]+)\b", r"\1", text)
    return text.replace("[", "").replace("]", "")


def filled(text, words):
    """With a word for each placeholder, the next one each time; `CODE...` twice. Quoted text stays."""
    turns = {name: itertools.cycle(values) for name, values in words.items()}

    def word(name):
        if name not in turns:
            raise NoWord(f"no word for {name}")
        return next(turns[name])

    def fill(token):
        repeated = token.endswith("...") and token != "..."
        token = token.removesuffix("...")
        if token in turns:
            return " ".join(word(token) for _ in range(2 if repeated else 1))
        pieces = re.split(r"([A-Z][A-Z_]*(?![a-z]))", token)
        if len(pieces) > 1 and not token.startswith(("'", '"', "-", "$")) and not re.match(r"[A-Z]+=[a-z]", token):
            once = "".join(word(piece) if at % 2 else piece for at, piece in enumerate(pieces))
            return once
        return token

    return " ".join(fill(token) for token in text.split(" ") if token != "...")


def commands_of(template, words):
    """All that is left out, and all that is there."""
    found = []
    for text in alternatives(template):
        for one in (without_brackets(text), with_brackets(text)):
            command = filled(one, words)
            if command not in found:
                found.append(command)
    return found
