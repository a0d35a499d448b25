"""What is wrong with an extension for macOS, as its file has it: no machine here can load it.  The layout is that of Apple's <mach-o/loader.h>,
<mach-o/nlist.h> and <kern/cs_blobs.h>."""

import hashlib
import struct

PROCESSORS = {"arm64": 0x0100000C, "x86_64": 0x01000007}  # CPU_TYPE_ARM64, CPU_TYPE_X86_64
SYSTEM = "/usr/lib/libSystem.B.dylib"  # the C library, with mathematics and threads, of every Mac
OF_ONE_PROCESSOR, LIBRARY, BUNDLE = 0xFEEDFACF, 6, 8  # MH_MAGIC_64, MH_DYLIB, MH_BUNDLE
SYMBOLS, SIGNATURE, VERSION = 0x2, 0x1D, 0x32  # LC_SYMTAB, LC_CODE_SIGNATURE, LC_BUILD_VERSION
LIBRARIES = 0xC, 0x80000018, 0x8000001F, 0x20, 0x80000023  # LC_LOAD_DYLIB, and weak, re-exported, lazy and upward ones


def objections(content, processor, oldest):
    """Why macOS from this version, (major, minor), on this processor would not load the extension, whose bytes these are, or Python not import it."""
    magic, its_processor, _, kind, count = struct.unpack_from("<5I", content)
    if magic != OF_ONE_PROCESSOR or its_processor != PROCESSORS[processor]:
        return [f"it is not of {processor} alone"]
    found = [] if kind in (LIBRARY, BUNDLE) else ["it is neither a library nor a bundle"]
    commands = list(load_commands(content, count))
    for command, at in commands:
        if command in LIBRARIES and (name := text(content, at + struct.unpack_from("<I", content, at + 8)[0])) != SYSTEM:
            found.append(f"it needs {name}")
    versions = [struct.unpack_from("<I", content, at + 12)[0] for command, at in commands if command == VERSION]
    needed = [(version >> 16, version >> 8 & 0xFF) for version in versions]
    if len(needed) != 1 or needed[0] > oldest:
        found.append(f"it needs macOS {needed}; its name promises {oldest}")
    for name in of_no_library(content, commands):
        if not name.startswith(("_Py", "__Py")):  # abi3audit looks at those
            found.append(f"no library that it names has {name}")
    return found + signature(content, commands, its_processor == PROCESSORS["arm64"])


def load_commands(content, count):
    at = 32  # after the header
    for _ in range(count):
        command, size = struct.unpack_from("<2I", content, at)
        yield command, at
        at += size


def text(content, at):
    return content[at : content.index(b"\0", at)].decode()


def of_no_library(content, commands):
    """Names that it takes from elsewhere, and not from one of its libraries: the system looks for them in all that is loaded, Python too."""
    libraries = sum(command in LIBRARIES for command, _ in commands)
    for command, at in commands:
        if command == SYMBOLS:
            symbols, count, names, _ = struct.unpack_from("<4I", content, at + 8)
            for i in range(count):
                name, kind, _, description, _ = struct.unpack_from("<IBBHQ", content, symbols + 16 * i)
                if kind & 0xEF == 0x01 and not 1 <= description >> 8 <= libraries:  # N_EXT alone, which is undefined; GET_LIBRARY_ORDINAL
                    yield text(content, names + name)


def signature(content, commands, required):
    """Objections to its signature.  A Mac with an Arm processor ends a process that reads a page of code whose SHA-256 the signature has not."""
    places = [struct.unpack_from("<2I", content, at + 8) for command, at in commands if command == SIGNATURE]
    if not places:
        return ["it is not signed, not even ad hoc"] if required else []
    signed = places[0][0]  # bytes, all before the signature
    kinds = dict(struct.unpack_from(">2I", content, signed + 12 + 8 * i) for i in range(struct.unpack_from(">I", content, signed + 8)[0]))
    directory = content[signed + kinds[0] :]  # CSSLOT_CODEDIRECTORY
    hashes, pages, limit = (struct.unpack_from(">I", directory, offset)[0] for offset in (16, 28, 32))
    size, kind, page = directory[36], directory[37], 1 << directory[39]
    if (size, kind, limit, pages) != (32, 2, signed, -(-signed // page)):  # CS_HASHTYPE_SHA256
        return ["its signature is not of SHA-256, or not of the whole file"]
    changed = [i for i in range(pages) if hashlib.sha256(content[i * page : min((i + 1) * page, limit)]).digest() != directory[hashes + 32 * i :][:32]]
    return [f"{len(changed)} of its {pages} pages have changed since it was signed"] if changed else []
