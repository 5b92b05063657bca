"""Tables with units. The only module that imports pandas."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _fields
from ._errors import missing

if TYPE_CHECKING:
    import pandas


def library() -> Any:
    """pandas, or an error that tells how to get it."""
    try:
        import pandas
    except ImportError as error:
        raise missing("pandas", "pandas", "a table") from error
    return pandas


class Columns:
    """Columns of a table to be, with units and descriptions."""

    def __init__(self) -> None:
        self.values: dict[str, NDArray[Any]] = {}
        self.units: dict[str, str] = {}
        self.descriptions: dict[str, str] = {}

    def add(self, name: str, values: NDArray[Any], unit: str, description: str) -> None:
        """A column, or one for each component."""
        single = values.ndim == 1
        columns = [values] if single else list(values.T)
        names: Sequence[str] = (name,) if single else _fields.components(name, len(columns))
        for column, one in zip(names, columns):
            self.values[column] = np.ascontiguousarray(one)
            self.units[column] = unit
            self.descriptions[column] = description

    def table(self, **attributes: Any) -> pandas.DataFrame:
        """The table; its `attrs` hold units, descriptions and the attributes given."""
        table: pandas.DataFrame = library().DataFrame(self.values)
        table.attrs.update(units=self.units, descriptions=self.descriptions, **attributes)
        return table


def categories(numbers: pandas.Series[Any], names: tuple[str, ...]) -> pandas.Categorical:
    """Numbers as categories with names; numbers without a name keep their digits."""
    most = int(numbers.max()) if len(numbers) else -1
    known = [*names, *(str(number) for number in range(len(names), most + 1))]
    codes: pandas.Categorical = library().Categorical.from_codes(numbers.to_numpy(), known)
    return codes
