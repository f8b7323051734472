"""ATI's Net F/T over real sockets of this computer: our adapter, the public client."""

import time

import pytest

from palpate.adapters.hardware import MonotonicClock, RigContext
from palpate.adapters.hardware.plugins import force_sensor_maker
from palpate.core.errors import DeviceError
from palpate.core.ports import Validity
from palpate.drivers.ati import read_box
from palpate.drivers.errors import DriverError
from palpate.simulation.emulators.ati import EmulatedBox, NetFtServer

LOAD = (1.5, -2.0, -10.0, 0.1, 0.2, -0.3)


def table(server):
    return {"host": server.host, "port": server.port, "http_port": server.http_port, "max_age_ms": 500.0}


def test_adapter_reads_a_box_and_is_told_that_it_has_gone():
    context = RigContext.of("zebra-zero", MonotonicClock())
    with NetFtServer(EmulatedBox(lambda now_ns: LOAD)) as server:
        sensor = force_sensor_maker("ati-netft")(table(server), context)
        sensor.configure()
        sensor.activate()
        sample = sensor.read()
        assert sample.validity is Validity.VALID
        assert (*sample.force_N, *sample.torque_Nm) == pytest.approx(LOAD, abs=1e-6)
        assert sensor.reported_facts().range_N == (330.0, 330.0, 990.0)
    # Nobody is at the port now: the next request that is sent comes back.
    sensor.device.stop()
    time.sleep(0.05)
    with pytest.raises(DeviceError, match="cannot be reached"):
        sensor.read()
    sensor.close()


def test_public_client_reads_the_same():
    client_of = pytest.importorskip("NetFT").Sensor
    with NetFtServer(EmulatedBox(lambda now_ns: LOAD)) as server:
        client = client_of(server.host)
        client.sock.connect((server.host, server.port))  # it knows ATI's own port only
        client.sock.settimeout(5.0)
        counts = [round(1e6 * value) for value in LOAD]
        assert client.getMeasurement() == counts
        client.startStreaming(handler=False)
        assert [client.receive() for _ in range(20)] == [counts] * 20
        client.stopStreaming()
        client.sock.close()


@pytest.mark.parametrize("host", ["a..b", "a" * 70 + ".net"])
def test_name_that_no_host_can_have_is_one_error(host):
    with pytest.raises(DriverError, match="cannot be fetched"):
        read_box(host, 80, 1.0)
