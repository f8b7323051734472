from palpate.drivers.zebra_zero.arm import ZebraZero
from palpate.drivers.zebra_zero.states import State
from tests.unit.drivers.nmc.line import Line


def test_smoke():
    line = Line()
    arm = ZebraZero(line, line.clock, line.clock.sleep)
    arm.connect()
    arm.confirm_home(at_home=True)
    arm.servo_on()
    assert arm.state is State.SERVO_ON
    m = arm.cycle(tuple(q + 0.001 for q in arm.cycle(None).position_rad))
    print(m, arm.smooth_stop(), arm.report)
