"""The theory: plants, designs, norms. Knows no paper and no plot; `load` reads the file of a running observer."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from replication.estimation.api.portable import load
else:
    from replication.estimation.lazy import lazy

    __getattr__ = lazy(__name__)

__all__ = ["load"]
