"""The page of a box: as a Gamma with firmware 2.2.59 sends it, and as nobody should."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.drivers.ati.box import parse_box
from palpate.drivers.errors import DriverError, SettingError

PAGE = b"""<?xml version="1.0"?><netft>
<runstat>0x00000000</runstat><runrate>7000</runrate><cfgnam>empty</cfgnam><cfgcalsn>FT27462</cfgcalsn>
<scfgfu>N</scfgfu><scfgtu>Nm</scfgtu><cfgtfx>0;0;132.710;0;0;0</cfgtfx>
<cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt><cfgmr>330;330;990;30;30;30</cfgmr>
<comrdte>Enabled</comrdte><comrdtrate>100</comrdtrate><comrdtbsiz>1</comrdtbsiz><mfgdigver>2.2.59</mfgdigver>
</netft>"""


def test_a_box_is_read() -> None:
    box = parse_box(PAGE)
    assert (box.counts_per_N, box.counts_per_Nm, box.rate_Hz, box.sample_Hz) == (1e6, 1e6, 100.0, 7000.0)
    assert (box.range_N, box.range_Nm) == ((330.0, 330.0, 990.0), (30.0, 30.0, 30.0))
    assert box.calibration == "FT27462"
    assert parse_box(PAGE.replace(b">Nm<", b">N-m<")) == box  # as older firmware says it


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (b">N<", b">lbf<", "lbf, not N; set the force units to N"),
        (b">Nm<", b">lbf-in<", "lbf-in, not Nm; set the torque units"),
        (b"Enabled", b"Disabled", "Disabled, not Enabled; enable RDT"),
        (b"cfgcpf", b"other", "has no cfgcpf"),
        (b"330;330;", b"330;", "cfgmr"),
        (b"<cfgcpt>1000000", b"<cfgcpt>0", "cfgcpt = '0'"),
        (b"<comrdtrate>100", b"<comrdtrate>nan", "comrdtrate"),
    ],
)
def test_a_box_that_does_not_fit_says_what_to_change(old: bytes, new: bytes, words: str) -> None:
    with pytest.raises(SettingError, match=words):
        parse_box(PAGE.replace(old, new))


@given(st.binary(max_size=30), st.integers(0, len(PAGE)), st.integers(0, len(PAGE)))
def test_no_page_raises_anything_else(noise: bytes, begin: int, end: int) -> None:
    try:
        parse_box(PAGE[:begin] + noise + PAGE[end:])
    except DriverError:
        pass
