# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""Tokens of a C++ source, with the partner of each bracket.

Templates' angle brackets are brackets here. `<` and `>` are operators where both sides have a space, which is how
clang-format writes them, and only there.
"""

import re

PUNCTUATORS = (
    "<<=", "...", "->*", "::", "->", "++", "--", "<<", "<=", ">=", "==", "!=", "&&", "||", "+=", "-=", "*=", "/=", "%=",
    "&=", "|=", "^=", "##", "{", "}", "(", ")", "[", "]", ";", ",", "?", ":", ".", "+", "-", "*", "/", "%", "&", "|", "^",
    "~", "!", "=", "<", ">", "#", "\\", "@", "$", "`")
PATTERN = re.compile(
    r"(?P<space>\s+)"
    r"|(?P<comment>//[^\n]*|/\*.*?\*/)"
    r"|(?P<raw>(?:u8|[uUL])?R\"(?P<mark>[^()\s\\]*)\(.*?\)(?P=mark)\")"
    r"|(?P<string>(?:u8|[uUL])?\"(?:\\.|[^\"\\\n])*\")"
    r"|(?P<char>(?:u8|[uUL])?'(?:\\.|[^'\\\n])+')"
    r"|(?P<number>\.?\d(?:[eEpP][+-]|'?[\w.])*)"
    r"|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<punctuator>" + "|".join(re.escape(text) for text in PUNCTUATORS) + ")",
    re.DOTALL)
DIRECTIVE = re.compile(r"[ \t]*#(?:[^\n\\]|\\.|\\\n)*", re.DOTALL)
CLOSERS = {"(": ")", "[": "]", "{": "}"}
# False on the machines that run the mutants: their branch is not compiled.
NEVER_DEFINED = re.compile(
    r"__CUDACC__|__CUDA_ARCH__|CULLET_HAS_CUDA|_MSC_VER|_WIN32|__APPLE__|__clang__|__ARM_NEON|__aarch64__")


class SourceError(Exception):
    """A source whose brackets do not match: nothing in it is mutated."""


class Token:
    __slots__ = ("kind", "text", "begin", "end", "line", "spaced_left", "spaced_right", "partner", "is_angle")

    def __init__(self, kind, text, begin, end, line):
        self.kind, self.text, self.begin, self.end, self.line = kind, text, begin, end, line
        self.spaced_left = self.spaced_right = True
        self.partner = None
        self.is_angle = False

    def __repr__(self):
        return f"{self.text}@{self.line}"


class Conditionals:
    """Which of the nested #if branches at a place is never compiled."""

    def __init__(self):
        self.skipped = []

    def see(self, directive):
        match = re.match(r"\s*#\s*(\w+)(.*)", directive, re.DOTALL)
        if match is None:
            return
        word, condition = match.groups()
        if word in ("if", "ifdef", "ifndef"):
            is_never = NEVER_DEFINED.search(condition) is not None and "||" not in condition
            is_negated = word == "ifndef" or condition.strip().startswith("!")
            self.skipped.append(is_never and not is_negated)
        elif word == "elif" and self.skipped:
            self.skipped[-1] = NEVER_DEFINED.search(condition) is not None
        elif word == "else" and self.skipped:
            self.skipped[-1] = False
        elif word == "endif" and self.skipped:
            self.skipped.pop()

    def is_skipped(self):
        return any(self.skipped)


def tokenize(text):
    """Tokens of `text` without spaces, comments, directives and branches that are never compiled."""
    tokens, place, line = [], 0, 1
    conditionals = Conditionals()
    is_line_start = True
    while place < len(text):
        directive = DIRECTIVE.match(text, place) if is_line_start else None
        if directive:
            conditionals.see(directive.group())
            line += directive.group().count("\n")
            place = directive.end()
            is_line_start = False
            continue
        match = PATTERN.match(text, place)
        if match is None:
            raise SourceError(f"line {line}: cannot read {text[place:place + 20]!r}")
        kind = match.lastgroup if match.lastgroup != "mark" else "raw"
        if kind not in ("space", "comment") and not conditionals.is_skipped():
            tokens.append(Token(kind, match.group(), place, match.end(), line))
        is_line_start = kind == "space" and "\n" in match.group()
        line += match.group().count("\n")
        place = match.end()
    for token in tokens:
        token.spaced_left = token.begin == 0 or text[token.begin - 1].isspace()
        token.spaced_right = token.end >= len(text) or text[token.end].isspace()
    tokens = join_shifts(tokens)
    match_brackets(tokens)
    match_angles(tokens)
    return tokens


def join_shifts(tokens):
    """`>` `>` with spaces around both is a shift; two that close templates are not."""
    joined = []
    for token in tokens:
        last = joined[-1] if joined else None
        if token.text in (">", ">=") and last is not None and last.text == ">" and last.end == token.begin and \
                last.spaced_left and token.spaced_right:
            last.text, last.end, last.spaced_right = last.text + token.text, token.end, True
        else:
            joined.append(token)
    return joined


def match_brackets(tokens):
    opened = []
    for index, token in enumerate(tokens):
        if token.kind != "punctuator":
            continue
        if token.text in CLOSERS:
            opened.append(index)
        elif token.text in CLOSERS.values():
            if not opened or CLOSERS[tokens[opened[-1]].text] != token.text:
                raise SourceError(f"line {token.line}: {token.text} closes nothing")
            token.partner = opened.pop()
            tokens[token.partner].partner = index
    if opened:
        raise SourceError(f"line {tokens[opened[-1]].line}: {tokens[opened[-1]].text} is never closed")


def match_angles(tokens):
    for index, token in enumerate(tokens):
        if token.text == "<" and not token.is_angle and not (token.spaced_left and token.spaced_right):
            close_angle(tokens, index)
        elif token.text == "<" and index > 0 and tokens[index - 1].text == "template":
            close_angle(tokens, index)


def close_angle(tokens, opening):
    """Finds the `>` of tokens[opening] and of the angle brackets within it."""
    if opening > 0 and tokens[opening - 1].text == "operator":
        return
    opened, index = [opening], opening + 1
    pairs = []
    while index < len(tokens) and opened:
        token = tokens[index]
        if token.text in CLOSERS:
            index = token.partner
        elif token.text in (")", "]", "}", ";"):
            return
        elif token.text == "<" and not (token.spaced_left and token.spaced_right):
            opened.append(index)
        elif token.text == "<" and tokens[index - 1].text == "template":
            opened.append(index)
        elif token.text == ">" and not (token.spaced_left and token.spaced_right):
            pairs.append((opened.pop(), index))
        index += 1
    if opened:
        return
    for begin, end in pairs:
        tokens[begin].is_angle = tokens[end].is_angle = True
        tokens[begin].partner, tokens[end].partner = end, begin
