# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""Which variables a statement reads and changes, as far as its tokens tell.

A variable is a path: `a->b[i].c` is (a, b, c), and a change of (a, b) is one of everything in it. A statement changes what it
assigns, increments, calls a member of or writes to with `<<`; a function that it calls on its own may change its arguments.
Calls inside an expression count as reading.
"""

ASSIGNMENT = {"=", "+=", "-=", "*=", "/=", "%=", "|=", "&=", "^=", "<<=", ">>="}
STEPS = {"++", "--"}
STREAMS = {"<<", ">>"}
MEMBER = {".", "->"}
WORDS = {"sizeof", "true", "false", "nullptr", "const", "auto", "new", "delete", "return"}


class Chain:
    """The names from `index` on that are joined by `.`, `->` and `::`, up to the first call."""

    def __init__(self, tokens, index):
        self.names = []
        self.opening = None  # of the arguments, if it is called
        place = index
        while True:
            self.names.append(tokens[place].text)
            place = after_groups(tokens, place + 1, ("[", "<"))
            if tokens[place].text == "(":
                self.opening = place
                place = tokens[place].partner + 1
                break
            is_joined = tokens[place].text in MEMBER or tokens[place].text == "::"
            if not is_joined or tokens[place + 1].kind != "name":
                break
            if tokens[place].text == "::":
                self.names.pop()
            place += 1
        self.next = tokens[after_groups(tokens, place, ("[",))].text

    @property
    def path(self):
        """The variable: of a call its object, () where it has none."""
        names = self.names if self.opening is None else self.names[:-1]
        return tuple(names[1:] if names[:1] == ["this"] else names)


def after_groups(tokens, place, openings):
    while tokens[place].text in openings and tokens[place].partner is not None and tokens[place].partner > place:
        place = tokens[place].partner + 1
    return place


class Effects:
    def __init__(self, code, begin, end):
        self.uses, self.changes = set(), set()
        tokens = code.tokens
        called = None  # the opening of the arguments of a function that is the statement
        for index in range(begin, end):
            if tokens[index].kind != "name" or tokens[index - 1].text in MEMBER or tokens[index - 1].text == "::":
                continue
            chain = Chain(tokens, index)
            is_statement = index == begin
            if is_statement and chain.opening is not None and not chain.path and chain.next in ASSIGNMENT | {";"}:
                called = chain.opening
            if not chain.path or chain.path[0] in WORDS:
                continue
            self.uses.add(chain.path)
            if chain.next in ASSIGNMENT | STEPS or tokens[index - 1].text in STEPS or \
                    (called is not None and code.parents[index] == called) or \
                    (is_statement and (chain.opening is not None or chain.next in STREAMS)):
                self.changes.add(chain.path)

    def depend_on(self, other):
        """Whether one of both changes what the other uses."""
        return any(is_inside(first, second) or is_inside(second, first)
                   for changes, uses in ((self.changes, other.uses), (other.changes, self.uses))
                   for first in changes for second in uses)


def is_inside(path, whole):
    return path[:len(whole)] == whole
