"""The list of parts of a wheel (SBOM), in the CycloneDX format: what is compiled into it, what it needs when it runs, what built it."""

import email
import hashlib
import re
import subprocess
import zipfile
from importlib import metadata
from pathlib import Path

from cyclonedx.model import HashAlgorithm, HashType, Property
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentScope, ComponentType
from cyclonedx.model.license import DisjunctiveLicense, LicenseExpression
from cyclonedx.output.json import JsonV1Dot5
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from packageurl import PackageURL
from packaging.requirements import Requirement

BUILDERS = ("scikit-build-core", "nanobind", "ninja", "cmake", "numpy", "ziglang")


ROOT = Path(__file__).resolve().parents[2]


def clang():
    """What the compiler says of itself.  Its C++ library, which is linked statically, has its version."""
    path = Path(metadata.distribution("ziglang").locate_file("ziglang/zig"))
    return subprocess.run([path, "cc", "--version"], check=True, capture_output=True, text=True).stdout.splitlines()[0]


def component(name, version, licence, kind="generic", **more):
    url = PackageURL(kind, None, name.lower(), version)
    licences = [LicenseExpression(licence) if " " in licence else DisjunctiveLicense(id=licence)]
    return Component(name=name, version=version, type=ComponentType.LIBRARY, purl=url, bom_ref=str(url), licenses=licences, **more)


def compiled_in():
    """Libraries whose code is in the extension."""
    pugixml = re.search(r"set\(KSL_FETCHED_PUGIXML (\S+)\)", (ROOT / "cmake/pugixml.cmake").read_text(encoding="utf-8"))[1]
    yield component("pugixml", pugixml, "MIT")
    yield component("libc++", re.search(r"version (\S+)", clang())[1], "Apache-2.0 WITH LLVM-exception")
    yield component("nanobind", metadata.version("nanobind"), "BSD-3-Clause", "pypi")
    robin = next(path for path in metadata.files("nanobind") if path.name == "robin_hash.h").locate()
    growth = Path(robin).with_name("robin_growth_policy.h").read_text(encoding="utf-8")
    version = ".".join(re.search(rf"TSL_RH_VERSION_{part} (\d+)", growth)[1] for part in ("MAJOR", "MINOR", "PATCH"))
    yield component("robin-map", version, "MIT")


def needed(requirements):
    """What the wheel asks for; packages of extras are optional."""
    for line in requirements:
        wanted = Requirement(line)
        if wanted.name == "ksl" or (wanted.marker and 'extra == "test"' in str(wanted.marker)):
            continue
        scope = ComponentScope.OPTIONAL if wanted.marker and "extra" in str(wanted.marker) else ComponentScope.REQUIRED
        properties = [Property(name="ksl:versions", value=str(wanted.specifier) or "any")]
        if wanted.marker:
            properties.append(Property(name="ksl:when", value=str(wanted.marker)))
        url = PackageURL("pypi", None, wanted.name.lower())
        yield Component(name=wanted.name, type=ComponentType.LIBRARY, scope=scope, purl=url, bom_ref=line, properties=properties)


def tools():
    for name in BUILDERS:
        yield Component(name=name, version=metadata.version(name), type=ComponentType.APPLICATION, bom_ref=f"tool:{name}")
    yield Component(name="clang", version=clang(), type=ComponentType.APPLICATION, bom_ref="tool:clang")


def of_wheel(wheel):
    """The SBOM of a wheel as text, valid by the schema."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        said = email.message_from_bytes(archive.read(name))
    digest = HashType(alg=HashAlgorithm.SHA_256, content=hashlib.sha256(Path(wheel).read_bytes()).hexdigest())
    bom = Bom()
    bom.metadata.component = component("ksl", said["Version"], "BSD-3-Clause", "pypi", hashes=[digest])
    for part in [*compiled_in(), *needed(said.get_all("Requires-Dist", []))]:
        bom.components.add(part)
    bom.register_dependency(bom.metadata.component, bom.components)
    for tool in tools():
        bom.metadata.tools.components.add(tool)
    text = JsonV1Dot5(bom).output_as_string(indent=1)
    if error := JsonStrictValidator(SchemaVersion.V1_5).validate_str(text):
        raise ValueError(f"the list of parts is not valid CycloneDX: {error}")
    return text
