# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""The mutants of a source: which text becomes which, by kind of change.

comparison, arithmetic, bits      another operator
condition, logic                  a condition negated, never or always true; an operand of && and || dropped
constant                          a literal or a kName off by one, doubled, halved
arguments, order                  two arguments swapped, or two statements one of which changes what the other uses
statement                         a call, an assignment or a jump dropped
lock, memory-order                a mutex of no other thread; relaxed (visible to ThreadSanitizer, seldom to a test)
"""

import re
from dataclasses import dataclass

from cpp_code import Code
from cpp_effects import Effects
from cpp_tokens import tokenize

PRECEDENCE = {
    "*": 10, "/": 10, "%": 10, "+": 9, "-": 9, "<<": 8, ">>": 8, "<": 7, ">": 7, "<=": 7, ">=": 7, "==": 6, "!=": 6, "&": 5,
    "^": 4, "|": 3, "&&": 2, "||": 1}
COMPARISONS = {
    "<": ("<=", ">"), "<=": ("<", ">="), ">": (">=", "<"), ">=": (">", "<="), "==": ("!=",), "!=": ("==",)}
ARITHMETIC = {"+": ("-",), "-": ("+",), "*": ("/",), "/": ("*",), "%": ("*",)}
BITS = {"&": ("|",), "|": ("&",), "^": ("|",), "<<": (">>",), ">>": ("<<",)}
ASSIGNMENTS = {
    "+=": "-=", "-=": "+=", "*=": "/=", "/=": "*=", "|=": "&=", "&=": "|=", "^=": "|=", "<<=": ">>=", ">>=": "<<="}
STOPS = {",", "?", ":", ";", "=", *ASSIGNMENTS, "%="}
KEYWORD_STOPS = {"return", "else", "throw", "case", "co_return", "do"}
COMMUTATIVE = {"min", "max", "dot", "swap", "hypot", "abs", "static_cast", "reinterpret_cast"}
# Functions of this library whose result is the same for both orders of two arguments of one type.
COMMUTATIVE |= {"areFarApart", "bytesOf", "closenessOf", "distanceMoved", "flip", "gapOf", "isHeld", "isInsideSkin", "keyOf", "larger",
                "makePair", "meets", "overlapOf", "overlaps", "overlapsBranchless", "overlapsWithMargin", "ownerCell",
                "passesFilter", "smaller"}
NAMED_CONSTANT = re.compile(r"k[A-Z]\w*$")
INTEGER = re.compile(r"(0[xX][\da-fA-F']+|0[bB][01']+|\d[\d']*)([uUlLzZ]*)$")
LOCK = re.compile(r"(lock_guard|unique_lock|scoped_lock)$")
STRONG_ORDER = re.compile(r"memory_order_(acquire|release|acq_rel|seq_cst|consume)$")
LONGEST = 700  # characters of an expression that is duplicated


@dataclass(frozen=True)
class Mutant:
    file: str
    line: int
    line_text: str
    first_line: int  # of what is replaced
    line_count: int
    begin: int  # of what is replaced, in characters of the source
    end: int
    kind: str
    original: str
    mutated: str
    shown: str  # what a reader sees in place of begin to end
    replacement: str  # with @ID@

    @property
    def key(self):
        return " :: ".join((self.file, self.line_text, f"{self.original} -> {self.mutated}"))


class Finder:
    def __init__(self, file, source):
        self.file, self.source = file, source
        self.lines = source.split("\n")
        self.tokens = tokenize(source)
        self.code = Code(self.tokens)
        self.found = []

    def find(self):
        for index, token in enumerate(self.tokens):
            if not self.code.runs[index]:
                continue
            if self.is_binary(index):
                self.mutate_operator(index)
            elif token.text == "?":
                self.mutate_ternary(index)
            elif token.text in ("if", "while", "for") and self.tokens[index + 1].text == "(":
                self.mutate_condition(index)
            elif token.text == "(":
                self.mutate_arguments(index)
            elif token.kind == "number":
                self.mutate_number(index)
            elif token.kind == "name":
                self.mutate_name(index)
        self.mutate_statements()
        return self.found

    # Text

    def text(self, begin, end):
        """The tokens from begin to end, exclusive, on one line and without comments."""
        parts = []
        for index in range(begin, end):
            if index > begin and self.tokens[index].begin > self.tokens[index - 1].end:
                parts.append(" ")
            parts.append(self.tokens[index].text)
        return "".join(parts)

    def raw(self, begin, end):
        return self.source[self.tokens[begin].begin:self.tokens[end - 1].end]

    def add(self, kind, begin, end, original, mutated, replacement, at=None, shown=None):
        token = self.tokens[begin if at is None else at]
        line_text = " ".join(self.lines[token.line - 1].split())
        first, last = self.tokens[begin], self.tokens[end - 1]
        line_count = last.line - first.line + 1
        shown = mutated if shown is None else shown
        self.found.append(Mutant(self.file, token.line, line_text, first.line, line_count, first.begin, last.end, kind,
                                 original, mutated, shown, replacement))

    def add_choice(self, kind, begin, end, mutated, at=None):
        """Tokens begin to end become a choice between `mutated` and themselves."""
        if self.tokens[end - 1].end - self.tokens[begin].begin > LONGEST:
            return
        original = self.text(begin, end)
        if mutated != original:
            self.add(kind, begin, end, original, mutated, f"(cullet_mutant(@ID@) ? {mutated} : {self.raw(begin, end)})", at)

    # Operators

    def is_binary(self, index):
        token = self.tokens[index]
        return token.text in PRECEDENCE and token.kind == "punctuator" and not token.is_angle and token.spaced_left and \
            token.spaced_right and self.code.ends_operand(index - 1) and self.tokens[index - 1].text != "operator"

    def ends_left(self, index, precedence):
        token = self.tokens[index]
        if token.text in STOPS or token.text in KEYWORD_STOPS:
            return True
        if token.partner is not None and token.partner > index and not token.is_angle:
            return True
        if token.text == "}" and self.code.is_block(token.partner):
            return self.tokens[token.partner - 1].text not in (")", "]")
        if token.text == ")" and self.tokens[token.partner - 1].text in ("if", "for", "while", "switch"):
            return True
        return self.is_binary(index) and PRECEDENCE[token.text] < precedence

    def left_of(self, index, precedence):
        place = index - 1
        while not self.ends_left(place, precedence):
            token = self.tokens[place]
            place = (token.partner if token.partner is not None and token.partner < place else place) - 1
        return place + 1

    def right_of(self, index, precedence):
        place = index + 1
        while True:
            token = self.tokens[place]
            if token.text in STOPS or (token.text in (")", "]", "}") and token.partner < place):
                return place
            if self.is_binary(place) and PRECEDENCE[token.text] <= precedence:
                return place
            place = (token.partner if token.partner is not None and token.partner > place else place) + 1

    def mutate_operator(self, index):
        operator = self.tokens[index].text
        precedence = PRECEDENCE[operator]
        begin, end = self.left_of(index, precedence), self.right_of(index, precedence)
        if begin >= index or end <= index + 1:
            return
        if operator in ("&&", "||"):
            self.drop_operand(operator, begin, index)
            self.drop_operand(operator, index + 1, end)
            return
        for kind, table in (("comparison", COMPARISONS), ("arithmetic", ARITHMETIC), ("bits", BITS)):
            for other in table.get(operator, ()):
                if kind == "comparison" and len(other) != len(operator) and self.is_extreme(begin, index, end):
                    continue
                part = self.text if kind == "comparison" else self.operand
                mutated = f"{part(begin, index)} {other} {part(index + 1, end)}"
                self.add_choice(kind, begin, end, mutated, at=index)

    def is_extreme(self, begin, index, end):
        """Whether it is the condition of a maximum or minimum, `a < b ? a : b`: either of two equal numbers is the same."""
        if self.tokens[end].text != "?":
            return False
        operands = ((begin, index), (index + 1, end))
        for first, second in (operands, operands[::-1]):
            colon = end + 1 + first[1] - first[0]
            last = colon + 1 + second[1] - second[0]
            if self.tokens[last:] and self.tokens[colon].text == ":" and self.text(end + 1, colon) == self.text(*first) and \
                    self.text(colon + 1, last) == self.text(*second) and self.right_of(colon, PRECEDENCE["||"]) == last:
                return True
        return False

    def operand(self, begin, end):
        """In parentheses where another operator beside it might bind otherwise."""
        text = self.text(begin, end)
        return f"({text})" if any(self.is_binary(index) for index in self.code.top_level(begin, end)) else text

    def drop_operand(self, operator, begin, end):
        value, guard = ("true", "cullet_mutant(@ID@) ||") if operator == "&&" else ("false", "!cullet_mutant(@ID@) &&")
        self.add("logic", begin, end, f"{operator} {self.text(begin, end)}", value, f"({guard} ({self.raw(begin, end)}))")

    def mutate_ternary(self, index):
        begin = self.left_of(index, 1)
        if begin < index:
            condition = self.text(begin, index)
            self.add_choice("condition", begin, index, f"!({condition})", at=index)

    # Conditions

    def mutate_condition(self, index):
        opening = index + 1
        begin, end = opening + 1, self.tokens[opening].partner
        ends = [place for place in self.code.top_level(begin, end) if self.tokens[place].text == ";"]
        word = self.tokens[index].text
        if word == "for" and len(ends) == 2:
            begin, end = ends[0] + 1, ends[1]
        elif word == "for" or ends:
            return
        is_expression = self.tokens[begin].kind == "punctuator" or self.code.is_expression(begin) or begin + 1 == end
        if begin >= end or not is_expression:
            return
        condition, raw = self.text(begin, end), self.raw(begin, end)
        original = f"{word} ({condition})"
        self.add("condition", begin, end, original, f"{word} (false)", f"!cullet_mutant(@ID@) && ({raw})", index, "false")
        if word == "if":
            self.add("condition", begin, end, original, f"{word} (true)", f"cullet_mutant(@ID@) || ({raw})", index, "true")
            self.add("condition", begin, end, original, f"{word} (!({condition}))",
                     f"cullet_mutant(@ID@) != static_cast<bool>({raw})", index, f"!({condition})")

    # Constants

    def mutate_number(self, index):
        text = self.tokens[index].text
        match = INTEGER.match(text)
        if match is None:
            self.add_choice("constant", index, index + 1, f"(2 * {text})")
            self.add_choice("constant", index, index + 1, f"(0.5f * {text})")
            if float_of(text) == 0:
                self.found.pop()
                self.found.pop()
                self.add_choice("constant", index, index + 1, f"({text} + 1)")
            return
        digits, suffix = match.groups()
        value = int(digits.replace("'", ""), 0 if not digits.isdigit() else 10)
        self.add_choice("constant", index, index + 1, f"{value + 1}{suffix}")
        if value > 0:
            self.add_choice("constant", index, index + 1, f"{value - 1}{suffix}")
        if value >= 4:
            self.add_choice("constant", index, index + 1, f"{2 * value}{suffix}")
            self.add_choice("constant", index, index + 1, f"{value // 2}{suffix}")

    def mutate_name(self, index):
        text = self.tokens[index].text
        if text in ("true", "false"):
            self.add_choice("constant", index, index + 1, "true" if text == "false" else "false")
        elif NAMED_CONSTANT.match(text) and self.tokens[index - 1].text not in (".", "->"):
            following = self.tokens[index + 1]
            if following.text in ("(", "::", "{", "[", ".", "=") or following.is_angle:
                return
            begin = self.code.left_of_chain(index)
            for change in ("next", "twice", "half"):
                self.add_choice("constant", begin, index + 1, f"cullet_{change}({self.text(begin, index + 1)})")
        elif STRONG_ORDER.match(text):
            self.relax_order(index)

    # Calls

    def chain_of_call(self, opening):
        """First token of the call with its arguments at `opening`; None if it is no call."""
        callee = self.tokens[opening - 1]
        is_callee = callee.kind == "name" and self.code.ends_operand(opening - 1) or (callee.is_angle and callee.text == ">")
        if not is_callee:
            return None
        begin = self.code.left_of_chain(opening - 1)
        before = self.tokens[begin - 1]
        is_declaration = self.code.ends_operand(begin - 1) and before.text not in (")", "}") or \
            before.text in ("~", "new", "operator", "const", "auto") or \
            (before.text in ("*", "&", "&&") and not before.spaced_left)
        if before.text == ")" and self.tokens[before.partner - 1].text not in ("if", "for", "while", "switch"):
            return None
        return None if is_declaration else begin

    def arguments_of(self, opening):
        closing = self.tokens[opening].partner
        commas = [index for index in self.code.top_level(opening + 1, closing) if self.tokens[index].text == ","]
        edges = [opening, *commas, closing]
        return [(first + 1, last) for first, last in zip(edges, edges[1:])]

    def mutate_arguments(self, opening):
        arguments = self.arguments_of(opening)
        if len(arguments) < 2 or self.tokens[opening - 1].text in COMMUTATIVE or self.tokens[opening - 1].is_angle:
            return
        begin = self.chain_of_call(opening)
        if begin is None:
            return
        texts = [self.text(first, last) for first, last in arguments]
        for place in range(len(texts) - 1):
            # A lambda is never of another argument's type, and a memory order seldom.
            if "[" in (texts[place][:1], texts[place + 1][:1]) or "memory_order" in texts[place] + texts[place + 1]:
                continue
            swapped = texts[:place] + [texts[place + 1], texts[place]] + texts[place + 2:]
            mutated = f"{self.text(begin, opening + 1)}{', '.join(swapped)})"
            self.add_choice("arguments", begin, self.tokens[opening].partner + 1, mutated, at=opening)

    def relax_order(self, index):
        opening = self.code.parents[index]
        begin = self.chain_of_call(opening) if self.tokens[opening].text == "(" else None
        if begin is None:
            return
        end = self.tokens[opening].partner + 1
        mutated = self.text(begin, index) + "memory_order_relaxed" + self.text(index + 1, end)
        self.add_choice("memory-order", begin, end, mutated, at=index)

    # Statements

    def mutate_statements(self):
        last = None
        for begin, end in self.code.statements:
            is_jump = end == begin + 1 and self.tokens[begin].text in ("break", "continue", "return")
            if is_jump or self.code.is_expression(begin):
                statement, raw = self.text(begin, end + 1), self.raw(begin, end + 1)
                self.add("statement", begin, end + 1, statement, "{}", f"{{ if (!cullet_mutant(@ID@)) {raw} }}")
                if not is_jump:
                    self.mutate_assignment(begin, end)
                    self.swap_statements(last, (begin, end))
                    last = (begin, end)
            else:
                self.drop_lock(begin, end)

    def mutate_assignment(self, begin, end):
        for index in self.code.top_level(begin, end):
            other = ASSIGNMENTS.get(self.tokens[index].text)
            if other is None:
                continue
            mutated = f"{self.text(begin, index)} {other} {self.text(index + 1, end)};"
            kind = "arithmetic" if other[0] in "+-*/" else "bits"
            self.add(kind, begin, end + 1, self.text(begin, end + 1), mutated,
                     f"{{ if (cullet_mutant(@ID@)) {mutated} else {self.raw(begin, end + 1)} }}", index)

    def swap_statements(self, first, second):
        if first is None or first[1] + 1 != second[0] or self.code.parents[first[0]] != self.code.parents[second[0]]:
            return
        # The body of an `if` without braces is no statement of the block.
        before = self.tokens[first[0] - 1]
        if before.text in (")", "else", "do", ":"):
            return
        if self.tokens[second[1]].end - self.tokens[first[0]].begin > LONGEST or \
                not Effects(self.code, *first).depend_on(Effects(self.code, *second)):
            return
        texts = [self.text(part[0], part[1] + 1) for part in (first, second)]
        self.add("order", first[0], second[1] + 1, " ".join(texts), " ".join(reversed(texts)),
                 f"{{ if (cullet_mutant(@ID@)) {{ {texts[1]} {texts[0]} }} else {{ {self.raw(first[0], second[1] + 1)} }} }}")

    def drop_lock(self, begin, end):
        if not any(LOCK.match(self.tokens[index].text) for index in range(begin, end)):
            return
        opening = next((index for index in self.code.top_level(begin, end) if self.tokens[index].text == "("), None)
        if opening is None:
            return
        first, last = self.arguments_of(opening)[0]
        mutex = self.text(first, last)
        self.add("lock", first, last, mutex, f"cullet_unshared({mutex})",
                 f"(cullet_mutant(@ID@) ? cullet_unshared({mutex}) : {self.raw(first, last)})")


def float_of(text):
    try:
        return float(text.rstrip("fFlL").replace("'", ""))
    except ValueError:
        return None


def mutants_of(file, source):
    return Finder(file, source).find()
