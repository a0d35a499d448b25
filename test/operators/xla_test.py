"""Our declarations of XLA's foreign function interface are those of the header that jaxlib brings."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

jax = pytest.importorskip("jax", reason="needs JAX: pip install 'ksl[jax]'")

OURS = Path(__file__).resolve().parents[2] / "python/operators/xla.hpp"
STRUCTS = {
    "extension": ("XLA_FFI_Extension_Base", {"size": "struct_size", "type": "type", "next": "next"}),
    "version": ("XLA_FFI_Api_Version", {"size": "struct_size", "major": "major_version", "minor": "minor_version"}),
    "metadata": ("XLA_FFI_Metadata", {"size": "struct_size", "api": "api_version", "traits": "traits"}),
    "with_metadata": ("XLA_FFI_Metadata_Extension", {"base": "extension_base", "of": "metadata"}),
    "error_arguments": ("XLA_FFI_Error_Create_Args", {"size": "struct_size", "message": "message", "of": "errc"}),
    "functions": ("XLA_FFI_Api", {"size": "struct_size", "api": "api_version", "create_error": "XLA_FFI_Error_Create", "get_stream": "XLA_FFI_Stream_Get"}),
    "stream_arguments": ("XLA_FFI_Stream_Get_Args", {"size": "struct_size", "context": "ctx", "stream": "stream"}),
    "buffer": ("XLA_FFI_Buffer", {"size": "struct_size", "type": "dtype", "data": "data", "rank": "rank", "shape": "dims"}),
    "scalar": ("XLA_FFI_Scalar", {"type": "dtype", "value": "value"}),
    "text": ("XLA_FFI_ByteSpan", {"first": "ptr", "length": "len"}),
    "buffers": ("XLA_FFI_Args", {"size": "struct_size", "n": "size", "kind": "types", "each": "args"}),
    "attributes": ("XLA_FFI_Attrs", {"size": "struct_size", "n": "size", "kind": "types", "name": "names", "each": "attrs"}),
    "call_frame": (
        "XLA_FFI_CallFrame",
        {
            "size": "struct_size",
            "first": "extension_start",
            "api": "api",
            "context": "ctx",
            "what": "stage",
            "arguments": "args",
            "results": "rets",
            "constants": "attrs",
        },
    ),
}
WHOLE = {"extension", "version", "error_arguments", "stream_arguments", "buffer", "scalar", "text", "buffers", "attributes"}
"""Structs that are embedded in others, or that we make: their sizes matter, too.  The others may grow at their ends."""
CONSTANTS = {
    "xla::metadata_extension": "XLA_FFI_Extension_Metadata",
    "xla::may_be_recorded": "XLA_FFI_HANDLER_TRAITS_COMMAND_BUFFER_COMPATIBLE",
    "xla::known_major": "XLA_FFI_API_MAJOR",
    "int(xla::code::invalid_argument)": "XLA_FFI_Error_Code_INVALID_ARGUMENT",
    "int(xla::code::internal)": "XLA_FFI_Error_Code_INTERNAL",
    "int(xla::number_type::s64)": "XLA_FFI_DataType_S64",
    "int(xla::number_type::f32)": "XLA_FFI_DataType_F32",
    "int(xla::number_type::f64)": "XLA_FFI_DataType_F64",
    "xla::is_buffer": "XLA_FFI_ArgType_BUFFER",
    "xla::is_scalar": "XLA_FFI_AttrType_SCALAR",
    "int(xla::step::execute)": "XLA_FFI_ExecutionStage_EXECUTE",
}


def test_structs_and_constants_are_those_of_the_header(tmp_path):
    compiler = shutil.which("c++") or shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        pytest.skip("no C++ compiler")
    lines = [f'#include "{OURS}"', "#include <cstddef>", '#include "xla/ffi/api/c_api.h"']
    for ours, (theirs, members) in STRUCTS.items():
        lines += [f'static_assert(offsetof(xla::{ours}, {a}) == offsetof({theirs}, {b}), "{ours}.{a}");' for a, b in members.items()]
        lines += [f'static_assert(sizeof(xla::{ours}) == sizeof({theirs}), "{ours}");'] if ours in WHOLE else []
    lines += [f'static_assert({ours} == {theirs}, "{theirs}");' for ours, theirs in CONSTANTS.items()]
    source = tmp_path / "same.cpp"
    source.write_text("\n".join(lines))
    done = subprocess.run([compiler, "-std=c++20", "-fsyntax-only", f"-I{jax.ffi.include_dir()}", source], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    declared = set(re.findall(r"^struct (\w+) \{", OURS.read_text(), re.M))
    assert declared == set(STRUCTS), "every struct is compared"
