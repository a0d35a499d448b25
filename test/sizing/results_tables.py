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
