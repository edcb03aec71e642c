"""Draw which folders import which, into docs/images/folders.svg: python docs/folders.py"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from html import escape
from pathlib import Path

import networkx as nx

ROOT = Path(__file__).resolve().parent.parent
PICTURE = ROOT / "docs" / "images" / "folders.svg"
WIDTH, BOX_WIDTH, BOX_HEIGHT, ROW_HEIGHT, MARGIN = 820, 132, 34, 78, 16


def imported(tree: ast.AST) -> Iterator[str]:
    """Modules that a module imports when it runs, also inside functions."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
        else:
            yield from imported(node)


def folder_graph() -> nx.DiGraph:
    """An edge from each folder below passgraph/ to those that it imports; folders on a cycle are one node."""
    graph = nx.DiGraph()
    package = ROOT / "passgraph"
    for folder in sorted(path.parent for path in package.glob("*/__init__.py")):
        graph.add_node(folder.name)
        for module in folder.rglob("*.py"):
            for name in imported(ast.parse(module.read_text(encoding="utf-8"))):
                parts = name.split(".")
                if parts[0] == "passgraph" and len(parts) > 1 and (package / parts[1]).is_dir():
                    graph.add_edge(folder.name, parts[1])
    graph.remove_edges_from(list(nx.selfloop_edges(graph)))
    graph.remove_nodes_from(list(nx.isolates(graph)))  # data only
    merged = nx.condensation(graph)
    names = {node: ", ".join(sorted(data["members"])) for node, data in merged.nodes(data=True)}
    reduced = nx.transitive_reduction(merged)
    return nx.relabel_nodes(reduced, names)


def drawn(graph: nx.DiGraph) -> str:
    """The graph as SVG: each folder stands below the lowest one that it imports."""
    rows = list(nx.topological_generations(graph.reverse()))
    places = {}
    for row, names in enumerate(rows):
        # Beside those that it imports, as far as one row lets it.
        ordered = sorted(names, key=lambda name: (_mean(places[n][0] for n in graph[name]), name))
        for column, name in enumerate(ordered):
            places[name] = (WIDTH * (column + 0.5) / len(ordered), MARGIN + BOX_HEIGHT / 2 + row * ROW_HEIGHT)
    height = 2 * MARGIN + BOX_HEIGHT + (len(rows) - 1) * ROW_HEIGHT
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" '
        'font-size="14" text-anchor="middle">',
        f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>',
    ]
    for source, target in sorted(graph.edges):
        (x, y), (to_x, to_y) = places[source], places[target]
        y, to_y = y - BOX_HEIGHT / 2, to_y + BOX_HEIGHT / 2
        middle = (y + to_y) / 2
        lines.append(
            f'<path d="M{x:.0f} {y:.0f} C{x:.0f} {middle:.0f} {to_x:.0f} {middle:.0f} {to_x:.0f} {to_y:.0f}" '
            'fill="none" stroke="#8a97a6" stroke-width="1.3"/>'
        )
    for name, (x, y) in sorted(places.items()):
        width = max(BOX_WIDTH, 9 * len(name))
        box = f'x="{x - width / 2:.0f}" y="{y - BOX_HEIGHT / 2:.0f}" width="{width}" height="{BOX_HEIGHT}"'
        lines.append(f'<rect {box} rx="6" fill="#e9f1f7" stroke="#3b6ea5"/>')
        lines.append(f'<text x="{x:.0f}" y="{y + 5:.0f}" fill="#17324d">{escape(name)}</text>')
    return "\n".join([*lines, "</svg>", ""])


def _mean(numbers: Iterator[float]) -> float:
    values = list(numbers)
    return sum(values) / len(values) if values else 0.0


if __name__ == "__main__":
    PICTURE.write_text(drawn(folder_graph()), encoding="utf-8")
