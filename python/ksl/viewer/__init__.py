"""The mechanism with its wrenches as a picture: in a page of its own, in an exported file, and as still images.

`scene` computes what there is to see, once for all samples; `live`, `export` and `still` draw it.
"""
