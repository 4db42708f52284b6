# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib

"""What the functions take for arrays."""

from typing import Any

import numpy


def numbers(array: Any) -> Any:
    """An array as it is; lists become float64."""
    return array if hasattr(array, "__dlpack__") else numpy.asarray(array, numpy.float64)


def indices(array: Any) -> Any:
    """An array as it is; lists become int64."""
    return array if hasattr(array, "__dlpack__") else numpy.asarray(array, numpy.int64)
