# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""Where a source has code that runs: what is inside a function and is no constant expression, type or macro.

Left out: constexpr functions, variables and conditions, static_assert, template arguments, array sizes of declarations,
case labels, captures and parameters of lambdas, sizeof and the like, arguments of intrinsics and of macros.
"""

import re

OPENERS = ("(", "[", "{")
NOT_OPERANDS = {
    "return", "else", "throw", "case", "delete", "auto", "do", "co_return", "co_yield", "and", "or", "not", "typename",
    "const", "operator", "goto", "mutable", "new", "in"}
CONTROLS = {"if", "for", "while", "switch"}
UNEVALUATED = {"sizeof", "alignof", "decltype", "noexcept", "static_assert", "alignas", "assert", "typeid", "offsetof"}
DECLARING = {
    "const", "static", "auto", "constexpr", "using", "typedef", "static_assert", "template", "struct", "class", "enum", "union",
    "thread_local", "volatile", "unsigned", "signed", "int", "bool", "float", "double", "char", "long", "short", "typename",
    "extern", "namespace", "friend", "inline", "asm", "alignas"}
INTRINSIC = re.compile(r"_mm\d*_|__builtin_|__atomic_|__m\d+|__")
MACRO = re.compile(r"[A-Z][A-Z0-9_]{3,}$")


class Code:
    """The code of a source: `runs[i]` for each token, `parents[i]` its innermost bracket, and the statements."""

    def __init__(self, tokens):
        self.tokens = tokens
        self.runs = [False] * len(tokens)
        self.parents = parents_of(tokens)
        self.scan_declarations(0, len(tokens))
        self.statements = list(self.find_statements())

    def is_group(self, index):
        token = self.tokens[index]
        return token.partner is not None and token.partner > index

    def top_level(self, begin, end):
        """Indices from begin to end without what is inside brackets; the brackets themselves are among them."""
        index = begin
        while index < end:
            yield index
            index = self.tokens[index].partner if self.is_group(index) else index + 1

    def scan_declarations(self, begin, end):
        head = index = begin
        while index < end:
            token = self.tokens[index]
            if token.text == "{":
                kind = self.kind_of_braces(head, index)
                if kind == "scope":
                    self.scan_declarations(index + 1, token.partner)
                elif kind == "function":
                    self.scan_body(index + 1, token.partner)
                if kind != "initializer":
                    head = token.partner + 1
                index = token.partner
            elif self.is_group(index):
                index = token.partner
            elif token.text == ";" or (token.text == ":" and self.tokens[index - 1].text in ("public", "private", "protected")):
                head = index + 1
            index += 1

    def kind_of_braces(self, head, opening):
        tokens = self.tokens
        indices = list(self.top_level(head, opening))
        words = [tokens[index].text for index in indices]
        parameters = [index for index in indices if tokens[index].text == "(" and tokens[index - 1].text not in UNEVALUATED]
        if "enum" in words:
            return "other"
        if {"namespace", "class", "struct", "union"} & set(words) or words[:1] == ["extern"] and len(words) == 2:
            return "scope"
        is_assigned = any(word == "=" and words[place - 1] != "operator" for place, word in enumerate(words) if place > 0)
        if is_assigned or not parameters:
            return "initializer"
        last = tokens[opening - 1]
        is_initialising = any(index > parameters[0] and tokens[index].text == ":" for index in indices)
        if is_initialising and (last.kind == "name" or last.is_angle):
            return "initializer"
        return "other" if "constexpr" in words else "function"

    def scan_body(self, begin, end):
        tokens = self.tokens
        for index in range(begin, end):
            self.runs[index] = True
        index = begin
        while index < end:
            after = self.after_constant(index, end)
            for inside in range(index, after):
                self.runs[inside] = False
            if after == index and self.is_local_class(index):
                opening = next(i for i in self.top_level(index, end) if tokens[i].text == "{")
                for inside in range(index, tokens[opening].partner + 1):
                    self.runs[inside] = False
                self.scan_declarations(opening + 1, tokens[opening].partner)
                after = tokens[opening].partner + 1
            index = max(after, index + 1)

    def is_local_class(self, index):
        if self.tokens[index].text not in ("struct", "class", "union") or self.tokens[index - 1].text not in (";", "{", "}"):
            return False
        texts = [self.tokens[i].text for i in self.top_level(index, min(index + 40, len(self.tokens)))]
        return "{" in texts and ";" not in texts[:texts.index("{")]

    def after_constant(self, index, end):
        """The end of the constant expression, type or macro call that begins at `index`; else `index`."""
        tokens = self.tokens
        token, following = tokens[index], tokens[index + 1]
        if token.text in ("using", "typedef", "static_assert", "enum", "asm", "template") or \
                (token.text == "constexpr" and tokens[index - 1].text != "if"):
            return next((i for i in self.top_level(index, end) if tokens[i].text == ";"), end)
        if token.text == "case":
            return next((i for i in self.top_level(index, end) if tokens[i].text == ":"), end)
        if token.is_angle and self.is_group(index):
            return token.partner + 1
        if token.text == "[" and not self.is_subscript(index):
            return self.after_lambda_head(index)
        if token.text == "[" and self.declares_array(index):
            return token.partner + 1
        is_called = following.text == "("
        if is_called and (token.text in UNEVALUATED or token.text == "constexpr" or INTRINSIC.match(token.text) or
                          MACRO.match(token.text)):
            return following.partner + 1
        return index

    def is_subscript(self, index):
        last = self.tokens[index - 1]
        return last.text in (")", "]", "}") or (last.kind in ("name", "string") and last.text not in NOT_OPERANDS) or \
            (last.is_angle and last.text == ">")

    def declares_array(self, index):
        """Whether `name[` at `index` follows a type."""
        name, before = self.tokens[index - 1], self.tokens[index - 2]
        return name.kind == "name" and ((before.kind == "name" and before.text not in NOT_OPERANDS) or before.is_angle or
                                        (before.text in ("*", "&") and not before.spaced_left))

    def after_lambda_head(self, index):
        after = self.tokens[index].partner + 1
        if self.tokens[after].text == "(":
            after = self.tokens[after].partner + 1
        if self.tokens[after].text in ("mutable", "noexcept"):
            after += 1
        if self.tokens[after].text == "->":
            after = next((i for i in self.top_level(after, len(self.tokens)) if self.tokens[i].text == "{"), after)
        return after

    def is_block(self, opening):
        """Whether the `{` begins statements, and no list of values."""
        last = self.tokens[opening - 1]
        if last.text in (")", "else", "do", "try", "{", "}", ";", "]", "mutable", "noexcept", "const", "override", ":"):
            return True
        for index in range(opening - 1, max(opening - 20, 0), -1):
            token = self.tokens[index]
            if token.text == "->":
                return self.tokens[index - 1].text == ")"
            if token.kind != "name" and token.text not in ("::", "<", ">", "*", "&", ","):
                return False
        return False

    def begins_statement(self, index):
        parent = self.parents[index]
        if parent is None or self.tokens[parent].text != "{" or not self.is_block(parent):
            return False
        last = self.tokens[index - 1]
        if last.text == ")" and last.partner > 0:
            control = last.partner - 1
            return self.tokens[control].text in CONTROLS or (self.tokens[control].text == "constexpr")
        if last.text == ":":
            return self.is_label(index - 1)
        return last.text in (";", "{", "}", "else", "do")

    def is_label(self, colon):
        index = colon - 1
        while index > 0 and (self.tokens[index].kind in ("name", "number", "char") or self.tokens[index].text == "::"):
            if self.tokens[index].text in ("case", "default"):
                return True
            index -= 1
        return False

    def find_statements(self):
        """(first token, its `;`) of the statements that run."""
        for index, token in enumerate(self.tokens):
            if not self.runs[index] or not self.begins_statement(index):
                continue
            closing = self.tokens[self.parents[index]].partner
            end = next((i for i in self.top_level(index, closing) if self.tokens[i].text == ";"), None)
            if end is not None and token.text not in CONTROLS:
                yield index, end

    def is_expression(self, begin):
        """Whether the statement is an expression, and declares nothing."""
        first = self.tokens[begin]
        if first.text in ("*", "(", "++", "--", "this"):
            return True
        if first.kind != "name" or first.text in DECLARING or first.text in NOT_OPERANDS or MACRO.match(first.text) or \
                first.text in ("break", "continue", "goto", "default", "try", "catch", "public", "private", "protected"):
            return False
        index = begin + 1
        while self.tokens[index].text == "::" or self.tokens[index - 1].text == "::" or \
                (self.tokens[index].is_angle and self.is_group(index)):
            index = self.tokens[index].partner + 1 if self.is_group(index) else index + 1
        following = self.tokens[index]
        return following.kind == "punctuator" and following.text not in ("*", "&", "&&", ":", "{", "...")

    def left_of_chain(self, index):
        """First token of the postfix expression that ends at `index`, as in `a.b<T>(c)[d]`."""
        tokens = self.tokens
        while True:
            token = tokens[index]
            if token.text in (")", "]") or (token.is_angle and token.text == ">"):
                index = token.partner - 1
                if token.text == ")" and not self.ends_operand(index) and tokens[index].text != "]":
                    return index + 1
                continue
            if token.kind != "name":
                return index + 1
            last = tokens[index - 1]
            if last.text in ("::", ".", "->"):
                before = tokens[index - 2]
                if last.text == "::" and not (before.kind == "name" or before.is_angle):
                    return index - 1
                index -= 2
                continue
            if last.text == "template":
                index -= 3
                continue
            return index

    def ends_operand(self, index):
        token = self.tokens[index]
        if token.kind == "name":
            return token.text not in NOT_OPERANDS and token.text not in CONTROLS
        return token.kind in ("number", "string", "char", "raw") or token.text in (")", "]", "}") or \
            (token.is_angle and token.text == ">")


def parents_of(tokens):
    parents, opened = [], []
    for index, token in enumerate(tokens):
        is_bracket = token.partner is not None and not token.is_angle
        if is_bracket and token.partner < index:
            opened.pop()
        parents.append(opened[-1] if opened else None)
        if is_bracket and token.partner > index:
            opened.append(index)
    return parents
