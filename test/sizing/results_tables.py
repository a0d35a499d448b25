"""Tables of wrenches with several load cases, made from a model, for tests of what reads them."""

import json

import numpy as np
import pyarrow as pa


def results_table(model, cases: dict, **how) -> pa.Table:
    """A table with a case for each entry of {case: (time, q, v, a)}; how: on, at, axes, order of `Model.wrench_table`."""
    tables = []
    for case, (time, q, v, a) in cases.items():
        table = model.wrench_table(time, q, v, a, **how)
        named = pa.DictionaryArray.from_arrays(pa.array(np.zeros(len(table), dtype=np.int16)), pa.array([case]))
        tables.append(table.set_column(0, "case", named))
    said = json.loads(tables[0].schema.metadata[b"ksl"])
    said["cases"] = [said["cases"][0] | {"name": case} for case in cases]
    return pa.concat_tables(tables, promote_options="permissive").replace_schema_metadata({"ksl": json.dumps(said)})


AXIS = (0.6, 0.0, 0.8)
COLUMNS = ("fx", "fy", "fz", "tx", "ty", "tz", "position", "speed", "acceleration", "effort", "rotor")


def made_table(cases: dict, kind: str = "revolute", /, **metadata) -> pa.Table:
    """A table of one joint `j` with any numbers: {case: {column: (n)}}, whose columns are `time` and those of COLUMNS; zeros where one is missing."""
    parts = []
    for case, given in cases.items():
        n = len(given["time"])
        columns = {"case": [case] * n, "time": given["time"], "joint": ["j"] * n}
        columns |= {name: np.broadcast_to(np.asarray(given.get(name, 0.0), dtype=float), n) for name in COLUMNS}
        parts.append(pa.table({name: pa.array(x) for name, x in columns.items()}))
    joint = {"name": "j", "kind": kind, "axis": list(AXIS), "parent": "a", "child": "b"}
    said = {"robot": "r", "joints": [joint], "on": "child", "at": "joint", "axes": "joint"} | metadata
    return pa.concat_tables(parts).replace_schema_metadata({"ksl": json.dumps(said)})
