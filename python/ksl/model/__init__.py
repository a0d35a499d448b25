"""Models: mechanisms that simulate, can be changed, and are built in programs.

A package above this one uses what is public in its modules.  `Model` is here, too, for those who look for it; it is imported when it is used.
"""

TYPE_CHECKING = False  # as typing has it, whose import takes longer than that of this package
if TYPE_CHECKING:
    from ksl.model.model import Model as Model

__all__ = ["Model"]

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        """Imports the model when it is asked for (PEP 562)."""
        if name != "Model":
            raise AttributeError(f"module 'ksl.model' has no attribute {name!r}", name=name)
        from ksl.model.model import Model

        return Model
