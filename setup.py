"""Find the packages of a checkout without symbolic links, as git makes on Windows; the rest is in pyproject.toml."""

from pathlib import Path
from typing import Any

from setuptools import Distribution, find_packages, setup


class Checkout(Distribution):
    """A checkout whose links ``passgraph/backends`` and ``passgraph/effects`` may be small files of text."""

    def parse_config_files(self, *given: Any, **named: Any) -> None:
        super().parse_config_files(*given, **named)
        for name in ("backends", "effects"):
            if not Path("passgraph", name).is_dir():
                package = f"passgraph.{name}"
                self.packages = [*self.packages, package, *(f"{package}.{inner}" for inner in find_packages(name))]
                self.package_dir = {**(self.package_dir or {}), package: name}


setup(distclass=Checkout)
