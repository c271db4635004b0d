"""Writes study_methods.pyi, from which a type checker knows the methods of `Study` that capabilities bring, and the
classes of their results."""

from __future__ import annotations

from pathlib import Path

from chainunit import app
from chainunit.study.registry import modules

FILE = Path(app.__file__).with_name("study_methods.pyi")


def text() -> str:
    """The file."""
    imports, methods, results = [], [], []
    for module in sorted(modules("study_method"), key=lambda module: module.__name__):
        path = module.__name__.removeprefix("chainunit.")
        method, result = module.METHOD.__name__, module.RESULT.__name__
        imports += [
            f"from ..{path} import {result} as {result}",
            f"from ..{path} import {method} as _{method}",
        ]
        methods.append(f"    {method} = _{method}")
        results.append(f'"{result}"')
    head = "# Made by docs/make_types.py from the entry points of capabilities."
    shown = f"__all__ = [{', '.join(sorted(results))}]"
    return "\n".join([head, *imports, "", shown, "", "class StudyMethods:", *methods, ""])


if __name__ == "__main__":
    FILE.write_text(text(), "utf-8")
