#!/usr/bin/env python3
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""Tests of the mutator: where it makes mutants, what they are, and that the choice between them works.

CXX in the environment: the compiler of the tests that compile; without one they are left out.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import drawing  # noqa: E402
import executing  # noqa: E402
import reporting  # noqa: E402
from cpp_mutants import mutants_of  # noqa: E402
from cpp_tokens import SourceError  # noqa: E402
from workspace import Workspace, insert  # noqa: E402


def changes(body, kind=None):
    """`original -> mutated` of what a function with that body has."""
    found = mutants_of("a.cpp", "void f()\n{\n" + body + "\n}\n")
    return {f"{mutant.original} -> {mutant.mutated}" for mutant in found if kind in (None, mutant.kind)}


class LeavesAlone(unittest.TestCase):
    def assert_untouched(self, source):
        self.assertEqual([mutant.key for mutant in mutants_of("a.cpp", source)], [])

    def test_strings_characters_and_comments(self):
        self.assert_untouched('void f()\n{\n    // a < b && 3\n    /* x = 4; if (y) */\n    const char* s = "a < 3 && b";\n'
                              "    const char c = '<';\n    const auto r = R\"x(1 < 2; \"quoted\" )y\" )x\";\n}\n")

    def test_template_arguments(self):
        self.assert_untouched("template <class T, int N = 3>\nstd::array<T, 4 + 1> f()\n{\n    std::array<std::pair<int, int>, 7> x;\n"
                              "    return std::get<2>(x);\n}\n")

    def test_constant_expressions(self):
        self.assert_untouched("constexpr int kMost = 3 + 4;\nstatic_assert(kMost < 8, \"few\");\nenum E\n{\n    A = 1 << 3\n};\n"
                              "constexpr int f(int x)\n{\n    return x < 3 ? 1 : 2;\n}\n")

    def test_constant_expressions_inside_functions(self):
        self.assert_untouched("void f()\n{\n    constexpr int k = 3;\n    static_assert(sizeof(int) == 4);\n    float x[k + 2];\n"
                              "    if constexpr (k > 2)\n    {\n    }\n    switch (y)\n    {\n    case 3:\n    }\n"
                              "    using T = std::array<int, 5>;\n}\n")

    def test_array_sizes_and_default_arguments(self):
        self.assert_untouched("struct S\n{\n    float x[4];\n    int y = 3;\n    void f(int z = 5);\n};\n"
                              "void f()\n{\n    const auto g = [](int a = 3) { return a; };\n}\n")

    def test_preprocessor_lines(self):
        self.assert_untouched("#define F(x) \\\n    if (x < 3) \\\n        y = 4;\n#if A > 3 && B\n#endif\n#include <a/b>\nvoid f()\n{\n}\n")

    def test_branches_that_are_never_compiled(self):
        self.assert_untouched("void f()\n{\n#ifdef __CUDA_ARCH__\n    x = y + 3;\n#endif\n}\n")
        self.assertEqual(changes("#ifdef __CUDA_ARCH__\n    x = y + 3;\n#else\n    return g(4);\n#endif", "constant"),
                         {"4 -> 5", "4 -> 3", "4 -> 8", "4 -> 2"})

    def test_arguments_of_intrinsics_and_macros(self):
        self.assert_untouched("void f()\n{\n    const auto a = _mm256_permute_ps(b, 0x4e);\n    CULLET_CHECK(a < 3, b);\n"
                              "    const auto c = __builtin_shuffle(a, 4);\n}\n")

    def test_references_and_declarations(self):
        self.assertEqual(changes("const auto& a = b;\nT* const c(d, e);\nstd::vector<int> v(f, g);\nT&& h = i;"), set())

    def test_sources_it_cannot_read(self):
        self.assertRaises(SourceError, mutants_of, "a.cpp", "void f()\n{\n    if (a\n}\n")


class Makes(unittest.TestCase):
    def test_comparisons_of_whole_operands(self):
        self.assertEqual(changes("return a + b * c < d.e(f)[g] && h;", "comparison"),
                         {"a + b * c < d.e(f)[g] -> a + b * c <= d.e(f)[g]", "a + b * c < d.e(f)[g] -> a + b * c > d.e(f)[g]"})

    def test_comparisons_beside_template_arguments(self):
        self.assertEqual(changes("return static_cast<int>(a) > std::max<int>(b, c);", "comparison"),
                         {"static_cast<int>(a) > std::max<int>(b, c) -> static_cast<int>(a) >= std::max<int>(b, c)",
                          "static_cast<int>(a) > std::max<int>(b, c) -> static_cast<int>(a) < std::max<int>(b, c)"})

    def test_no_ties_of_maxima_and_minima(self):
        for body in ("x = a.b > c[1] ? a.b : c[1];", "x = f(a < b ? a : b);", "x = a < b ? b : a;"):
            self.assertEqual(len(changes(body, "comparison")), 1, body)
        for body in ("x = a > b ? a : b + 1;", "x = a > b ? a : c;", "x = a > b ? b + a : b;", "x = a > b;"):
            self.assertEqual(len(changes(body, "comparison")), 2, body)

    def test_no_swap_of_arguments_whose_order_does_not_matter(self):
        self.assertEqual(changes("x = psap::overlaps(a, b) && overlapsWithMargin(a, b, c) && std::min(a, b);", "arguments"), set())
        self.assertEqual(len(changes("x = isInside(a, b);", "arguments")), 1)

    def test_arithmetic_that_binds_as_before(self):
        self.assertEqual(changes("return a - b + c;", "arithmetic"), {"a - b -> a + b", "a - b + c -> (a - b) - c"})
        self.assertEqual(changes("x += y;", "arithmetic"), {"x += y; -> x -= y;"})

    def test_shifts_and_bits(self):
        self.assertEqual(changes("return a >> 3u & b;", "bits"), {"a >> 3u -> a << 3u", "a >> 3u & b -> (a >> 3u) | b"})

    def test_conditions(self):
        self.assertEqual(changes("if (a)\n    ++b;", "condition"),
                         {"if (a) -> if (false)", "if (a) -> if (true)", "if (a) -> if (!(a))"})
        self.assertEqual(changes("if (const auto* p = g())\n    ++b;", "condition"), set())
        self.assertEqual(changes("for (auto x : y)\n    ++b;", "condition"), set())
        self.assertEqual(changes("for (int i = 0; i < n; ++i)\n    ++b;", "condition"), {"for (i < n) -> for (false)"})

    def test_operands_of_conditions(self):
        self.assertEqual(changes("return a && b == c || d;", "logic"),
                         {"&& a -> true", "&& b == c -> true", "|| a && b == c -> false", "|| d -> false"})

    def test_constants(self):
        self.assertEqual(changes("return x[0] + 8u * kMost;", "constant"),
                         {"0 -> 1", "8u -> 9u", "8u -> 7u", "8u -> 16u", "8u -> 4u", "kMost -> cullet_next(kMost)",
                          "kMost -> cullet_twice(kMost)", "kMost -> cullet_half(kMost)"})
        self.assertEqual(changes("return 1.5e-3f;", "constant"), {"1.5e-3f -> (2 * 1.5e-3f)", "1.5e-3f -> (0.5f * 1.5e-3f)"})

    def test_statements_calls_and_jumps(self):
        self.assertEqual(changes("a.b(c);\nd = e;\nint f = g;\nif (h)\n    continue;\nreturn;", "statement"),
                         {"a.b(c); -> {}", "d = e; -> {}", "continue; -> {}", "return; -> {}"})

    def test_arguments_of_calls_and_not_of_declarations(self):
        self.assertEqual(changes("const T x(a, b);\nreturn g(a, b < c);", "arguments"), {"g(a, b < c) -> g(b < c, a)"})

    def test_order_of_statements_when_one_changes_what_the_other_uses(self):
        self.assertEqual(changes("a.b();\na.c();\nd.e();", "order"), {"a.b(); a.c(); -> a.c(); a.b();"})
        for first, second in (("a.x = b;", "c = a.x;"), ("c = a->x.y;", "a->x = b;"), ("a = b;", "b = c;"),
                              ("a.b();", "c = a.d.e;"), ("++a;", "b[a] = c;"), ("*a++ = b;", "c = a - d;"),
                              ("a[i] += b;", "c = a[j].x;"), ("std::copy(b, c, &a);", "d = a;"), ("f(a);", "b.g(a);"),
                              ("std::tie(a, b) = c;", "d = b;"), ("s << a;", "s << b;"), ("this->a = b;", "c = a;")):
            self.assertEqual(changes(f"{first}\n{second}", "order"), {f"{first} {second} -> {second} {first}"})

    def test_no_order_of_statements_that_only_read_the_same(self):
        for first, second in (("a.x = b;", "a.y = b;"), ("a = b.c();", "d = b.e();"), ("a.b(f(c));", "d.b(f(c));"),
                              ("std::memcpy(&a, &b, sizeof a);", "std::memcpy(&c, &d, sizeof c);"), ("a = x.b;", "b = y.a;"),
                              ("a = static_cast<T>(c);", "b = static_cast<T>(c);"),
                              ("f();", "g();"), ("a = b;", "f(b).c = d;")):
            self.assertEqual(changes(f"{first}\n{second}", "order"), set(), f"{first} {second}")

    def test_locks_and_memory_orders(self):
        self.assertEqual(changes("const std::lock_guard<std::mutex> lock(m_mutex);", "lock"),
                         {"m_mutex -> cullet_unshared(m_mutex)"})
        self.assertEqual(changes("m_flag.store(true, std::memory_order_release);", "memory-order"),
                         {"m_flag.store(true, std::memory_order_release) -> m_flag.store(true, std::memory_order_relaxed)"})

    def test_code_of_members_and_local_classes(self):
        source = ("struct S\n{\n    S() : m_a{1}, m_b(2) { c(); }\n    int d() const { return 3; }\n};\n"
                  "void f()\n{\n    struct T\n    {\n        int x = 4;\n        void g() { h(); }\n    };\n}\n")
        self.assertEqual({mutant.original for mutant in mutants_of("a.cpp", source)}, {"c();", "3", "h();"})


PROGRAM = """#include <cstdio>
template <int N = 1>
int count(const int* values, int size)
{
    int sum = 0;
    for (int i = 0; i < size; ++i)
        if (values[i] > N && values[i] < 9)
            sum += values[i];
    return sum;
}
int main()
{
    const int values[] = {1, 2, 3};
    std::printf("%d", count(values, 3));
}
"""


class Chooses(unittest.TestCase):
    """The schemata, compiled."""

    def setUp(self):
        compiler = os.environ.get("CXX") or shutil.which("c++")
        if not compiler:
            self.skipTest("no C++ compiler")
        self.folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.mutants = dict(enumerate((mutant for mutant in mutants_of("a.cpp", PROGRAM) if mutant.line == 7 or
                                       mutant.original.startswith("sum +=") and mutant.kind == "arithmetic"), 1))
        wanted = ("values[i] > N -> values[i] >= N", "&& values[i] < 9 -> true", "sum += values[i]; -> sum -= values[i];")
        self.mutants = {number: mutant for number, mutant in self.mutants.items()
                        if f"{mutant.original} -> {mutant.mutated}" in wanted}
        self.assertEqual(len(self.mutants), 3)
        self.compiler, self.runtime = compiler, HERE / "runtime"
        # As in a build folder: "cullet/..." is the tree.
        (self.folder / "include").mkdir()
        (self.folder / "include/cullet").symlink_to(HERE.parents[1])

    def build(self, numbers):
        source = self.folder / "a.cpp"
        source.write_text(insert(PROGRAM, [(number, self.mutants[number]) for number in numbers]))
        program = self.folder / "a"
        subprocess.run([self.compiler, "-std=c++17", "-I", str(self.folder / "include"), "-include",
                        str(self.runtime / "mutants.h"), str(source), str(self.runtime / "mutants.cpp"), "-o", str(program)],
                       check=True)
        return program

    def output(self, program, **environment):
        return subprocess.run([str(program)], env=dict(os.environ, **environment), check=True, capture_output=True,
                              text=True).stdout

    def test_by_environment(self):
        boundary = next(number for number, mutant in self.mutants.items() if mutant.kind == "comparison")
        sign = next(number for number, mutant in self.mutants.items() if mutant.kind == "arithmetic")
        program = self.build([boundary, sign])
        self.assertEqual(self.output(program), "5")
        self.assertEqual(self.output(program, CULLET_MUTANT=str(boundary)), "6")
        self.assertEqual(self.output(program, CULLET_MUTANT=str(sign)), "-5")

    def test_records_what_is_reached(self):
        operand = next(number for number, mutant in self.mutants.items() if mutant.kind == "logic")
        file = self.folder / "reach"
        self.output(self.build([operand]), CULLET_MUTANT="reach", CULLET_MUTANT_REACH=str(file))
        self.assertEqual(executing.read_reach("program --argument", file).mutants, {"*": {operand}})

    def test_keeps_numbers_of_lines(self):
        for number in self.mutants:
            mutated = insert(PROGRAM, [(number, self.mutants[number])])
            self.assertEqual(mutated.count("\n"), PROGRAM.count("\n"))


class Runs(unittest.TestCase):
    def setUp(self):
        source = "void f()\n{\n" + "".join(f"    x{i} = y{i} + z{i};\n" for i in range(40)) + "}\n"
        self.mutants = mutants_of("broad/a.cpp", source)

    def test_samples_that_depend_on_the_seed_alone(self):
        first, second, other = (drawing.cut(*drawing.draw(self.mutants, 10, seed)) for seed in (1, 1, 2))
        self.assertEqual(first, second)
        self.assertNotEqual(first, other)
        self.assertEqual(len(first), 10)

    def test_samples_stay_when_other_mutants_go(self):
        drawn, _ = drawing.draw(self.mutants, 10, 1)
        gone = drawn["broad", "arithmetic"][0]
        others, _ = drawing.draw([mutant for mutant in self.mutants if mutant.line != gone.line], 10, 1)
        lines = {mutant.line for mutants in drawn.values() for mutant in mutants}
        kept = {mutant.line for mutants in others.values() for mutant in mutants}
        self.assertEqual(lines - kept, {gone.line})

    def test_samples_have_each_kind_and_one_mutant_of_a_line(self):
        drawn, wanted = drawing.draw(self.mutants, 10, 1)
        lines = [mutant.line for mutants in drawn.values() for mutant in mutants]
        self.assertEqual(len(lines), len(set(lines)))
        self.assertEqual({kind for _, kind in wanted}, {"arithmetic", "statement"})

    def test_samples_are_no_larger_than_asked_for(self):
        self.assertEqual(len(drawing.cut(*drawing.draw(self.mutants, 1, 1))), 1)

    def test_equivalent_mutants_are_left_out(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "equivalent.txt"
            path.write_text("# comment\nbroad/* :: x1 = y1 + z1; :: * -> {} :: a reason\n")
            equivalents = drawing.Equivalents(path)
        marked = [mutant.original for mutant in self.mutants if equivalents.has(mutant)]
        self.assertEqual(marked, ["x1 = y1 + z1;"])

    def test_programs_of_longest_folder(self):
        table = {"broad/": ["a", "b"], "broad/psap/": ["c --d 3"], "plugin/": ["e"]}
        self.assertEqual(executing.programs_of(["broad/x.h", "broad/psap/y.h"], table), ["a", "b", "c --d 3"])
        self.assertEqual(executing.programs_of(["broad/x.h"], table, 1), ["a"])

    def test_programs_of_table_are_there(self):
        lists = "".join(path.read_text() for path in (HERE.parent).rglob("CMakeLists.txt"))
        table = executing.read_table(HERE / "programs.txt")
        names = {command.split()[0] for commands in table.values() for command in commands}
        self.assertEqual([name for name in sorted(names) if f"({name} " not in lists and f"({name}\n" not in lists], [])

    def test_fastest_tests_first_and_no_more_than_allowed(self):
        one, two = executing.Reach("one"), executing.Reach("two")
        one.seconds, two.seconds = {"A.a": 0.1, "A.b": 20.0}, {"B.a": 0.2, "B.c": 5.0, "B.d": 0.1}
        for test in ("A.a", "A.b"):
            one.mutants[test].add(7)
        two.mutants["*"].add(7)
        two.failed = ["B.d"]
        rounds, count = executing.Runner([one, two], {}, 30, None).rounds(7)
        self.assertEqual(count, 4)
        self.assertEqual([[(entry[0], entry[1]) for entry in programs] for programs in rounds],
                         [[("one", ["A.a"]), ("two", ["B.a"])], [("two", ["B.c"])], [("one", ["A.b"])]])
        rounds, _ = executing.Runner([one, two], {}, 3, None).rounds(7)
        self.assertEqual(sum(len(programs) for programs in rounds), 2)

    def test_slow_tests_of_a_program_beside_many_fast_ones_of_another(self):
        many, slow = executing.Reach("many"), executing.Reach("slow")
        many.seconds = {f"A.{number}": 0.1 for number in range(1000)}
        slow.seconds = {"B.a": 4.0, "B.b": 4.5}
        many.mutants["*"].add(7)
        slow.mutants["*"].add(7)
        chosen, count = executing.Runner([many, slow], {}, 10, None).chosen(7)
        self.assertEqual(count, 1002)
        self.assertEqual([test for _, _, test in chosen if test.startswith("B")], ["B.a"])
        self.assertGreater(len(chosen), 50)
        self.assertLessEqual(sum(seconds for seconds, _, _ in chosen), 10)

    def test_names_of_tests_that_noticed(self):
        self.assertEqual(executing.killing_test("[ RUN      ] A.b\n[  FAILED  ] A.b (3 ms)\n"), "A.b")
        self.assertEqual(executing.killing_test("[ RUN      ] A.b\n[ RUN      ] A.c\n"), "A.c")

    def test_programs_that_hang_end(self):
        self.assertIsNone(executing.execute(["sleep", "30"], {}, 0.2)[0])
        self.assertEqual(executing.execute(["sh", "-c", "exit 3"], {}, 30)[0], 3)

    def test_copies_all_sources_without_git(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in ("CMakeLists.txt", "narrow/build/a.h", "build/b.h", ".git/c", "tests/__pycache__/d"):
                path = Path(folder) / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.touch()
            work = Workspace(Path(folder), Path(folder) / "build/mutation", 1)
            self.assertEqual(sorted(work.files()), ["CMakeLists.txt", "narrow/build/a.h"])

    def test_compile_errors_name_their_mutant(self):
        with tempfile.TemporaryDirectory() as folder:
            work = Workspace(Path(folder), Path(folder).resolve(), 1)
            work.mutants = dict(enumerate(self.mutants, 1))
            place = f"{work.tree}/broad/a.cpp"
            lines = {mutant.line: {n for n, other in work.mutants.items() if other.line == mutant.line} for mutant in self.mutants}
            self.assertEqual(work.culprits(f"{place}:5:3: error: no\n{place}:7:1: warning: odd\n"), lines[5])
            self.assertEqual(work.culprits(f"{place}:6:3:   required from here\n/usr/include/x.h:3:1: error: no\n"), lines[6])

    def test_report_counts_by_folder_and_shows_survivors(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "broad/a.cpp"
            file.parent.mkdir()
            file.write_text("void f()\n{\n    return a < b;\n}\n")
            mutants = dict(enumerate(mutants_of("broad/a.cpp", file.read_text()), 1))
            results = {1: executing.Result("survived", reaching=["t (1)"], ran=1), 2: executing.Result("killed", "t A.b")}
            text = reporting.report("run", mutants, results, [], Path(folder))
        self.assertIn("| broad | 2 | 1 | 0 | 1 | 0 | 50 % |", text)
        self.assertIn("-    return a < b;\n+    return a <= b;\n", text)


if __name__ == "__main__":
    unittest.main()
