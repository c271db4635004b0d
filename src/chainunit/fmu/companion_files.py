"""The files of an FMU besides its model: documentation, licences, icon and terminals, reference results."""

from __future__ import annotations

from collections.abc import Sequence

from .description import Interface, licence_text, terminals
from .documentation import page
from .pack import xml_bytes
from .recipe import icon
from .reference import reference_results


def companion_files(
    interface: Interface, version: str, fmi: int, libraries: Sequence[str] = ()
) -> dict[str, bytes]:
    """Files by their path inside the FMU; `libraries` are the packages whose code the FMU contains: their licences
    are added."""
    model = interface.model
    sketch = model.sketch(interface.start_parameters)
    png, svg = (icon(model, kind, sketch) for kind in ("png", "svg"))
    files = {
        "documentation/index.html": interface.text(page(interface, version, sketch)).encode(),
        "documentation/licenses/license.txt": licence("chainunit", *libraries).encode(),
    }
    if fmi == 2:
        files["model.png"] = png
    else:
        files |= {"terminalsAndIcons/icon.png": png, "terminalsAndIcons/icon.svg": svg}
    if fmi == 3 or model.terminals:
        files["terminalsAndIcons/terminalsAndIcons.xml"] = xml_bytes(terminals(interface, with_icon=fmi == 3))
    return files | reference_results(interface)


def licence(*packages: str) -> str:
    """The licences of installed packages, in series."""
    return "\n\n".join(f"{name}\n\n{licence_text(name)}" for name in packages)
