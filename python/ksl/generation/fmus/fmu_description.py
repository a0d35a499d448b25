"""`modelDescription.xml` and `sources/buildDescription.xml` of an FMU (FMI 3.0.2, sections 2.4 and 2.5)."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

from ksl import _core
from ksl.base.printable import one_line
from ksl.generation.fmus.fmu_variables import UNITS, Causality, Layout

VARIABILITY: dict[Causality, str] = {"parameter": "fixed", "input": "continuous", "output": "continuous"}


def model_description(identifier: str, robot: str, what: str, token: str, layout: Layout, step: float | None) -> str:
    """step: that of the method, s; None where time changes nothing."""
    root = ElementTree.Element(
        "fmiModelDescription", fmiVersion="3.0", modelName=one_line(robot), instantiationToken=token, description=what,
        generationTool=f"KSL {_core.__version__}", variableNamingConvention="flat",
    )  # fmt: skip
    ElementTree.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        canHandleVariableCommunicationStepSize="true",
        canGetAndSetFMUState="true",
        canSerializeFMUState="true",
    )
    units = ElementTree.SubElement(root, "UnitDefinitions")
    for name, powers in UNITS.items():
        unit = ElementTree.SubElement(units, "Unit", name=name)
        ElementTree.SubElement(unit, "BaseUnit", {base: str(power) for base, power in powers.items()})
    ElementTree.SubElement(root, "DefaultExperiment", {"startTime": "0", "stopTime": "1"} | ({} if step is None else {"stepSize": repr(step)}))
    _variables(ElementTree.SubElement(root, "ModelVariables"), layout)
    _structure(ElementTree.SubElement(root, "ModelStructure"), layout)
    return _text(root)


def _variables(parent: ElementTree.Element, layout: Layout) -> None:
    ElementTree.SubElement(parent, "Float64", name="time", valueReference="0", causality="independent", variability="continuous", unit="s", description="time")
    for k, variable in enumerate(layout.variables):
        attributes = {"name": variable.name, "valueReference": str(k + 1), "causality": variable.causality, "variability": VARIABILITY[variable.causality]}
        attributes["description"] = variable.text
        if variable.unit:
            attributes["unit"] = variable.unit
        attributes |= {"initial": "calculated"} if variable.causality == "output" else {"start": repr(variable.start)}
        ElementTree.SubElement(parent, "Float64", attributes)


def _structure(parent: ElementTree.Element, layout: Layout) -> None:
    """Outputs; those that follow no input at the same instant say so, which keeps importers from solving loops that aren't there."""
    outputs = [(str(k + 1), variable) for k, variable in enumerate(layout.variables) if variable.causality == "output"]
    for reference, variable in outputs:
        ElementTree.SubElement(parent, "Output", {"valueReference": reference} | ({} if variable.depends_on_inputs else {"dependencies": ""}))
    for reference, _ in outputs:
        ElementTree.SubElement(parent, "InitialUnknown", valueReference=reference)


def build_description(identifier: str, sources: Sequence[str]) -> str:
    root = ElementTree.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ElementTree.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    files = ElementTree.SubElement(configuration, "SourceFileSet", language="C99", compiler="gcc", compilerOptions="-O2 -ffp-contract=off")
    for source in sources:
        ElementTree.SubElement(files, "SourceFile", name=source)
    ElementTree.SubElement(configuration, "Library", name="m", external="true")
    return _text(root)


def _text(root: ElementTree.Element) -> str:
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"
