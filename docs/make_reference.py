"""A hook of mkdocs: the reference of every key, FMU variable and command, written into the site. Run as a script, it
prints the page."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import typer.main

from chainunit.app.cli import app
from chainunit.report import study_task
from chainunit.report.markdown import markdown
from chainunit.report.reference import reference
from chainunit.study.registry import modules


def commands() -> Iterator[tuple[str, str, list[tuple[str, str]]]]:
    """Name of each command, the first paragraph of its help, and its arguments and options with their help."""
    group = typer.main.get_command(app)
    commands = {name: group.commands[name] for name in group.list_commands(typer.Context(group))}
    named = {name: command for name, command in commands.items() if not command.hidden}
    below = {
        f"{name} {own}": each
        for name, of in named.items()
        for own, each in getattr(of, "commands", {}).items()
    }
    for name, command in {"": group, **named, **below}.items():
        # some arguments are described when the help is asked for
        command.get_help(typer.Context(command))
        options = [
            (
                ", ".join(option.opts) if option.param_type_name == "option" else option.name.upper(),
                getattr(option, "help", None) or "",
            )
            for option in command.params
            if option.name not in ("help", "install_completion", "show_completion")
        ]
        yield name, " ".join((command.help or "").split()), options


def text() -> str:
    """The page."""
    head = (
        "# Reference\n\nThis page is made from the declarations. A number is in the declared "
        'SI unit; a text may have\nany unit of the same kind: `"150 mm"`, `"4 kNm"`, `"30 rev/min"`, `"8 %"`. '
        "`chainunit keys [TABLE]` shows the same on the terminal;\n`chainunit keys --schema` writes a JSON Schema by "
        "which editors complete and check a study file.\n"
    )
    tasks = [study_task.TASK, *(module.RESULT._task for module in modules("study_method"))]
    contents = {task.name: task.content for task in tasks}
    return head + markdown(reference(commands(), contents), ()).removeprefix("# Reference\n")


def on_files(files: Any, config: Any) -> Any:
    """Add the page to the files of the site."""
    from mkdocs.structure.files import File

    files.append(File.generated(config, "reference.md", content=text()))
    return files


if __name__ == "__main__":
    print(text(), end="")
