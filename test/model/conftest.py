import pytest


@pytest.fixture(params=["fixed", "floating"])
def arm(request, examples):
    import ksl

    return ksl.load(examples / "robots/panda.urdf", floating_base=request.param == "floating")
