# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

import inspect
import pathlib

import cullet
from cullet import _native


def test_package_has_stubs_and_its_marker():
    folder = pathlib.Path(cullet.__file__).parent
    assert (folder / "py.typed").is_file()
    stub = (folder / "_native.pyi").read_text()
    for name in ("class BoxSet", "class Hull", "def query_hulls"):
        assert name in stub


def test_every_public_name_has_a_docstring():
    named = [getattr(cullet, name) for name in cullet.__all__]
    documented = [thing for thing in named if inspect.isclass(thing) or inspect.isfunction(thing)]
    assert len(documented) >= 10
    for thing in documented:
        assert inspect.getdoc(thing), thing
        for name, member in vars(thing).items():
            if inspect.isfunction(member) and not name.startswith("_"):
                assert inspect.getdoc(member), name


def test_states_are_those_of_the_c_interface():
    header = pathlib.Path(__file__).parent.parent.parent / "abi" / "cullet.h"
    text = header.read_text()
    for state in cullet.State:
        assert f"CULLET_{state.name} = {state.value}" in text
    assert f'VERSION {cullet.__version__} ' in (header.parent.parent / "CMakeLists.txt").read_text()
    assert cullet.__version__ == _native.version
