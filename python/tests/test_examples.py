# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

import pathlib
import subprocess
import sys

import pytest

EXAMPLES = sorted((pathlib.Path(__file__).parent.parent / "examples").glob("*.py"))


def test_examples_are_there():
    assert len(EXAMPLES) >= 2


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_ends_with_success(example):
    subprocess.run([sys.executable, str(example)], check=True, timeout=120)
