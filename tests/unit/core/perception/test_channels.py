from palpate.core.perception.channels import CHANNELS


def test_the_vector_is_position_then_force_then_torque() -> None:
    assert "".join(CHANNELS) == "xyz" + "fxfyfz" + "txtytz"
