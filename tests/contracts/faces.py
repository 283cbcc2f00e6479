"""A contract for import-linter: a room is entered by its face only.

    [[tool.importlinter.contracts]]
    type = "faces"
    rooms = ["planner.search.*"]

A room is a package among ``rooms``; its face is what its ``__init__`` imports from its modules.
Modules outside import the package, never a module or a package inside it.
"""

from __future__ import annotations

from typing import Any, cast

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output
from importlinter.domain.helpers import module_expressions_to_modules


class FacesContract(Contract):
    """No import from outside a room goes past its face.

    Attributes:
        rooms: names of packages, with ``*`` for any one name; modules among them are no rooms.
        open: packages among them whose modules everybody may import, such as a catalogue.
    """

    type_name = "faces"

    rooms = fields.SetField(subfield=fields.ModuleExpressionField())
    open = fields.SetField(subfield=fields.ModuleExpressionField(), required=False)

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Look at every import of a module inside a room."""
        found: list[tuple[str, str, int]] = []
        for room in sorted(self._named(graph, self.rooms) - self._named(graph, self.open)):
            for inner in graph.find_descendants(room):
                for importer in graph.find_modules_that_directly_import(inner):
                    if importer != room and not importer.startswith(f"{room}."):
                        details = graph.get_import_details(importer=importer, imported=inner)
                        found.append((importer, inner, details[0]["line_number"] if details else 0))
        return ContractCheck(kept=not found, metadata={"found": sorted(set(found))})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Say which imports go past a face, and where."""
        for importer, inner, line in check.metadata["found"]:
            room = inner.rpartition(".")[0]
            output.print_error(f"{importer}:{line} imports {inner}; import it from {room}")

    def _named(self, graph: ImportGraph, expressions: Any) -> set[str]:
        if not expressions:
            return set()
        modules = module_expressions_to_modules(graph, cast(Any, expressions))
        return {module.name for module in modules}
