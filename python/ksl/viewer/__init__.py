"""The mechanism with its wrenches as a picture: in a page of its own, in an exported file, and as still images.

`scene` computes what there is to see, once for all samples; `live`, `export` and `still` draw it.

Files: `scene.py`: poses and wrenches of all samples at once; `visuals.py`, `shapes.py`: surfaces of links; `scene_tree.py`: the scene in viser's tree,
`live.py`, `controls.py` and `export.py`: its page, the panel in it, and its file; `gate.py`: who may open the page; `still.py`: figures of plotly; `results_scene.py`, `results_wrenches.py`:
motions and results; `notebook.py`: models in notebooks.
"""
