"""Golden bytes of the NMC protocol, for driver and emulator alike.

Source: tests of PyLabRobot's module ``agilent/vspin/_nmc.py``, which talks to real modules; those marked CALC are
calculated by hand from the tables of libnmc (brendandburns/ros2_zebra_zero, commit 6a558d7).
"""

COMMANDS = {
    "set address 1": "aa002101ff21",
    "read identity": "aa01132034",
    "define status": "aa01121f32",
    "no operation": "aa010e0f",
    "reset all": "aaff0f0e",
    "57600 baud": "aaff1a142d",
    "gains": "aa01e6c800b00496000f004b00a00f050007",
    "motor off": "aa0117021a",
    "clear bits": "aa010b0c",
    "reset position": "aa010001",
    "trapezoid": "aa01d49700000000c3f52800d71a00003d",
    "velocity profile": "aa0194b600000000dc02000029",
    "stop abruptly": "aa0117051d",  # CALC
    "one radian": "aa01d4975e770000a0860100102700009f",  # CALC
}

REPLY_OF_MASK_1F = "11222500004f000018e0050000a4"
"""Status 11, position 0x2522, A/D 4F, velocity 0, auxiliary 18, home 0x5E0; captured."""

CONVERSATION = (
    # A module from power-up, its supply on and its servo off: move done, power on, position error. CALC.
    ("set address 1", "1919"),
    ("no operation", "1919"),
    ("read identity", "19000a23"),
    ("no operation", "1919"),  # the mask of READ_STAT counts once
    ("motor off", "1919"),
    ("clear bits", "1919"),  # the error bit returns while the servo is off
    ("gains", "1919"),
    ("stop abruptly", "1919"),  # that bit stays until it is cleared, and the servo is on
    ("clear bits", "0909"),
    ("one radian", "0808"),
    ("stop abruptly", "0909"),
    ("trapezoid", "0808"),
    ("reset position", "0808"),
    ("57600 baud", ""),
    ("reset all", ""),
)
"""Commands by name, and what comes back."""
