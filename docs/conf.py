"""Settings of the site, which ``bash docs/build.sh`` builds with Sphinx."""

from __future__ import annotations

import ast
import inspect
import pkgutil
import re
import sys
from importlib import import_module
from pathlib import Path

import click
from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import passgraph
import passgraph.engines
from docs.effect_times import originals_table
from docs.effect_times import table as effect_times_table
from passgraph.commands.apply import apply
from passgraph.commands.entry import COMMANDS
from passgraph.effects.effect_table import EFFECTS, by_family
from passgraph.effects.parameters import Parameter
from passgraph.language.library import written_function
from passgraph.language.operations import OPERATIONS
from passgraph.language.symbols import WRITTEN

#: Folders of docs/examples in the order of the gallery.
FAMILIES = (
    "color", "filters", "scaling", "shadows", "ambient", "depth", "lens", "temporal", "style", "flat_worlds", "shaders",
)  # fmt: skip

project = "passgraph"
author = "The passgraph authors"
version = release = passgraph.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_click",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "examples", "gallery/**/*.ipynb", "gallery/**/*.py", "site"]
templates_path = ["site"]
# A build from scratch finds every page; `nitpicky` is off, since docstrings name private types.
nitpicky = False

myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 4

# Pages with `file_format: mystnb` are run, in a folder of their own.
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_merge_streams = True

# Scripts of docs/examples are run where they have changed, by the numpy backend.
sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "gallery_dirs": "gallery",
    "subsection_order": [f"examples/{family}" for family in FAMILIES],
    "within_subsection_order": "FileNameSortKey",
    "image_scrapers": ("docs.example_pictures.saved_pictures",),
    "reset_modules": (),
    "capture_repr": (),
    "thumbnail_size": (480, 270),
    "abort_on_example_error": True,
    "remove_config_comments": True,
    "show_signature": False,
    "write_computation_times": False,
    "download_all_examples": False,
}

# Docstrings write names in single backticks; those that are no reference are shown as code.
default_role = "code"
# Dashes only: quotes in sentences are often those of code.
smartquotes_action = "D"
add_module_names = False
autosummary_generate = True
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
# Shown by their names, not by what they stand for.
autodoc_type_aliases = {
    name: name for name in ("ArrayLike", "Float32", "Float64", "FloatBlock", "Outputs", "Isolation")
}
napoleon_google_docstring = False
napoleon_use_rtype = False
# Prose below "Returns", see `prepare_docstring`.
napoleon_custom_sections = ["Result"]
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88

# Prompts and printed results are not copied with an example.
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

html_theme = "pydata_sphinx_theme"
html_title = "passgraph"
html_static_path = ["site"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_theme_options = {
    "show_prev_next": True,
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
copyright = "The passgraph authors, MIT license"


def setup(app: Sphinx) -> None:
    app.connect("source-read", fill_generated_lists)
    app.connect("source-read", link_to_gallery)
    app.connect("autodoc-process-docstring", prepare_docstring, priority=400)  # before napoleon's 500
    app.connect("autodoc-process-signature", shorten_signature)
    app.connect("sphinx-click-process-description", escape_help)


def link_to_gallery(app: Sphinx, page: str, source: list[str]) -> None:
    """Turn links to scripts, which lead to their text in the repository, into links to their pages."""
    source[0] = re.sub(r"\]\(examples/([\w/]+)\.py\)", r"](gallery/\1.rst)", source[0])
    source[0] = source[0].replace("](examples/README.rst)", "](gallery/index.rst)")


def fill_generated_lists(app: Sphinx, page: str, source: list[str]) -> None:
    """Replace ``<!-- list of … -->`` in a page by the list, made from the code."""
    for mark, write in LISTS.items():
        if mark in source[0]:
            source[0] = source[0].replace(mark, write())


def escape_help(app: Sphinx | None, context: object, lines: list[str]) -> None:
    """Show the stars of wildcards and the hyphens of options in a command's help as they are."""
    lines[:] = [line.replace("*", "\\*").replace("--", "\\-\\-") for line in lines]


def prepare_docstring(app: Sphinx, what: str, name: str, about: object, options: object, lines: list[str]) -> None:
    """Rewrite the short forms of our docstrings to those that napoleon reads.

    ``name : meaning`` in a list of parameters becomes a name with an indented meaning: types are in the signature. A
    paragraph behind such a list, and what is returned as prose, become sections of their own.
    """
    if what in ("attribute", "property") and lines:
        # napoleon reads the words before a colon in the first line as a type.
        lines[0] = lines[0].replace(": ", " – ")
    section, written = "", []
    for number, line in enumerate(lines):
        if number + 1 < len(lines) and line and set(lines[number + 1].strip()) == {"-"}:
            section = line.strip()
            first, second = (*lines[number + 2 :], "", "")[:2]
            if section == "Returns" and not second.startswith("    ") and not FIELD.match(first):
                section, line = "Result", "Result"
        elif section in LISTED and (field := FIELD.match(line)):
            written += [field[1], f"    {field[2]}"]
            continue
        after = lines[number + 1] if number + 1 < len(lines) else ""
        begins = number > 0 and not lines[number - 1] and line[:1].strip() and not after.startswith("    ")
        if section in LISTED and begins and set(after.strip()) != {"-"}:
            section = ""
            written += ["Examples", "--------"] if line.startswith(">>>") else ["Notes", "-----"]
        written.append(line)
    lines[:] = written


def shorten_signature(
    app: Sphinx, what: str, name: str, about: object, options: object, signature: str | None, returns: str | None
) -> tuple[str, None] | None:
    """Leave the types out of an effect's signature: ranges make them long, and a table has them."""
    effect = next((effect for effect in EFFECTS.values() if effect.path.replace(":", ".") == name), None)
    if effect is None:
        return None
    parameters = inspect.signature(effect.function).parameters.values()
    plain = [parameter.replace(annotation=inspect.Parameter.empty) for parameter in parameters]
    return str(inspect.Signature(plain)), None


def effect_list() -> str:
    """A section for each effect: its name on the command line, its function, and its options."""
    sections = []
    for family, effects in by_family(EFFECTS.values()).items():
        sections.append(f"## {family}\n")
        for effect in effects:
            module, _, function = effect.path.partition(":")
            directives = f".. py:currentmodule:: {module}\n\n.. autofunction:: {function}"
            sections.append(f"### {effect.name}\n\n```{{eval-rst}}\n{directives}\n```\n")
            rows = [option_row(parameter) for parameter in effect.parameters]
            if rows:
                sections.append("\n".join(["| option | values | default |", "|---|---|---|", *rows, ""]))
    return "\n".join(sections)


def option_row(parameter: Parameter) -> str:
    """A row of the table of an effect's options on the command line."""
    if parameter.choices:
        values = ", ".join(f"`{choice}`" for choice in parameter.choices)
    elif parameter.type in ("float", "int", "rgb"):
        limits = f"{parameter.range}".replace("any number", "any")
        values = f"{TYPE_NAMES[parameter.type]}: {limits} {parameter.range.unit}".strip()
    else:
        values = TYPE_NAMES[parameter.type]
    default = "required" if parameter.required else "" if parameter.default is None else f"`{parameter.default}`"
    return f"| `--{parameter.name.replace('_', '-')}` | {values} | {default} |"


def engine_list() -> str:
    """A section for each module of `passgraph.engines` that attaches effects."""
    names = sorted(module.name for module in pkgutil.iter_modules(passgraph.engines.__path__))
    sections = []
    for name in names:
        module = import_module(f"passgraph.engines.{name}")
        if hasattr(module, "attach"):
            sections.append(
                f"## {name}\n\n```{{eval-rst}}\n.. automodule:: {module.__name__}\n   :members: attach\n```\n"
            )
    return "\n".join(sections)


def command_list() -> str:
    """Every command with its options; of apply, which has a command for each effect, the text alone."""
    others = ", ".join(sorted(COMMANDS.keys() - {"apply"}))
    directives = f""".. click:: passgraph.commands.entry:group
   :prog: passgraph
   :nested: full
   :commands: {others}

.. click:: passgraph.commands.apply:apply
   :prog: passgraph apply
   :nested: none
"""
    return f"```{{eval-rst}}\n{directives}```\n"


def apply_options() -> str:
    """The options that ``passgraph apply`` has for every effect; fog has them all, as it reads depth too."""
    context = click.Context(apply, info_name="apply")
    command = apply.get_command(context, "fog")
    own = {parameter.name for parameter in EFFECTS["fog"].parameters}
    lines = [".. program:: passgraph apply", ""]
    for parameter in command.params:
        if isinstance(parameter, click.Option) and parameter.name not in own:
            names, meaning = parameter.get_help_record(context)
            about = [meaning]
            escape_help(None, None, about)
            lines += [f".. option:: {names}", "", f"   {about[0]}", ""]
    body = "\n".join(lines)
    return f"```{{eval-rst}}\n{body}\n```\n"


def literal(text: str) -> str:
    """Escape what reStructuredText would read as markup."""
    return re.sub(r"([*|`_])", r"\\\1", text)


def function_list() -> str:
    """Every function of the kernel language: rows of the table of operations, and functions written in the language."""
    entries = {}
    for name, row in OPERATIONS.items():
        if getattr(passgraph.language, name, None) is row:
            bound = "exact" if row.ulp == 0 else f"{row.ulp:g} ULP" + (" of the largest term" if row.of_terms else "")
            entries[f"{name}({', '.join('abcde'[: len(row.signature.split('->')[0].split())])})"] = (
                f"{literal(row.doc)}. Types ``{row.signature}``; error bound: {bound}."
            )
    for symbol in WRITTEN:
        node = written_function(symbol.name, []).node
        parameters = ", ".join(f"{a.arg}: {ast.unparse(a.annotation)}" for a in node.args.args)
        entries[f"{symbol.name}({parameters}) -> {ast.unparse(node.returns)}"] = ast.get_docstring(node)
    body = "\n".join(f".. py:function:: {entry}\n\n   {entries[entry]}\n" for entry in sorted(entries))
    return f"```{{eval-rst}}\n.. py:currentmodule:: passgraph.language\n\n{body}\n```\n"


TYPE_NAMES = {
    "float": "number", "int": "whole number", "bool": "on or off", "choice": "word", "rgb": "three numbers",
    "picture": "picture file", "text": "text", "value": "value",
}  # fmt: skip
#: One name of a list, or several, and their meaning.
FIELD = re.compile(r"([*\w][\w, *`]*) : (.*)")
#: Sections of docstrings that are lists of names.
LISTED = {"Parameters", "Attributes", "Raises", "Returns"}
LISTS = {
    "<!-- table of effect times -->": effect_times_table,
    "<!-- table of originals -->": originals_table,
    "<!-- list of effects -->": effect_list,
    "<!-- list of engines -->": engine_list,
    "<!-- list of commands -->": command_list,
    "<!-- list of options of apply -->": apply_options,
    "<!-- list of kernel functions -->": function_list,
}
