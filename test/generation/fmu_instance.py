"""An instance of an FMU, by ctypes: for tests."""

import ctypes
import zipfile
from xml.etree import ElementTree

import numpy as np

OK, WARNING, DISCARD, ERROR = range(4)
LOG = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)
NUMBER, NOTHING = ctypes.c_double, ctypes.c_void_p


class Fmu:
    """The library and what modelDescription.xml says."""

    def __init__(self, file, folder):
        with zipfile.ZipFile(file) as archive:
            archive.extractall(folder)
        (self.path,) = folder.glob("binaries/*/*")
        self.library = ctypes.CDLL(str(self.path))
        self.root = ElementTree.parse(folder / "modelDescription.xml").getroot()
        self.variables = {v.get("name"): v for v in self.root.find("ModelVariables")}
        self.token = self.root.get("instantiationToken")

    def names(self, causality):
        return [name for name, v in self.variables.items() if v.get("causality") == causality]


class Instance:
    """Calls return what the function returns: a status; `said` has what was logged."""

    def __init__(self, fmu, token=None, start=True):
        self.fmu, self.said = fmu, []
        self._log = LOG(lambda _, status, category, message: self.said.append(message.decode()))
        make = fmu.library.fmi3InstantiateCoSimulation
        make.restype = ctypes.c_void_p
        self.pointer = make(b"one", (token or fmu.token).encode(), None, False, False, False, False, None, ctypes.c_size_t(0), None, self._log, None)
        if start and self.pointer:
            assert self.call("EnterInitializationMode", False, NUMBER(0), NUMBER(0), False, NUMBER(0)) == OK

    def call(self, function, *arguments):
        return getattr(self.fmu.library, f"fmi3{function}")(NOTHING(self.pointer), *arguments)

    def _numbers(self, function, names, values):
        references = (ctypes.c_uint32 * len(names))(*(int(self.fmu.variables[name].get("valueReference")) for name in names))
        return self.call(function, references, ctypes.c_size_t(len(names)), NOTHING(values.ctypes.data), ctypes.c_size_t(values.size))

    def set(self, names, values):
        return self._numbers("SetFloat64", names, np.array(values, float))

    def get(self, names, status=OK):
        values = np.full(len(names), np.nan)
        assert self._numbers("GetFloat64", names, values) == status, self.said
        return values

    def begin(self):
        return self.call("ExitInitializationMode")

    def step(self, time, size):
        flags, last = (ctypes.c_bool * 3)(), NUMBER(time)
        status = self.call("DoStep", NUMBER(time), NUMBER(size), True, *(ctypes.byref(flags, k) for k in range(3)), ctypes.byref(last))
        assert last.value == (time + size if status == OK else time) and not any(flags)
        return status

    def kept(self):
        state = ctypes.c_void_p()
        assert self.call("GetFMUState", ctypes.byref(state)) == OK
        return state
