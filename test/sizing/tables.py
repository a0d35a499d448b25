"""Tables of wrenches as `ksl loads` writes them, made from a model, for tests of what reads them."""

import json

import numpy as np
import pyarrow as pa


def results_table(model, cases: dict, effort_of: dict | None = None, **how) -> pa.Table:
    """A table with a case for each entry of {case: (time, q, v, a)}; how: on, at, axes of `Model.loads`."""
    tables = []
    for case, (time, q, v, a) in cases.items():
        table = model.loads(time, q, v, a, **how)
        n, names = len(time), [j.name for j in model.joints]
        columns = {"position": np.full((n, len(names)), np.nan), "acceleration": np.full((n, len(names)), np.nan)}
        for k, joint in enumerate(model.joints):
            if joint.one_coordinate:
                columns["position"][:, k] = np.asarray(q)[:, joint.q_index]
                columns["acceleration"][:, k] = np.asarray(a)[:, joint.v_index]
        for name, x in columns.items():
            if name not in table.column_names:
                table = table.append_column(name, pa.array(x.ravel(), mask=np.isnan(x.ravel())))
        if "case" not in table.column_names:
            words = pa.DictionaryArray.from_arrays(pa.array(np.zeros(len(table), dtype=np.int16)), pa.array([case]))
            table = table.add_column(0, "case", words)
        tables.append(table)
    whole = pa.concat_tables(tables, promote_options="permissive")
    said = json.loads(tables[0].schema.metadata[b"ksl"])
    said["joints"] = [{"name": j.name, "kind": j.kind, "axis": list(j.axis), "parent": j.parent, "child": j.child} for j in model.joints]
    return whole.replace_schema_metadata({"ksl": json.dumps(said)})
