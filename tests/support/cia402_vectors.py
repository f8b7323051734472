"""Golden SDO requests to a CiA 402 drive, node 1, for driver and emulator alike; by hand from CiA 301 and CiA 402-2."""

IDENTIFY = {
    "4000100000000000": "4300100092010200",  # 1000: profile 402, a servo drive
    "4018100400000000": None,  # 1018:04, the serial number
    "4008100000000000": "43081000454D5531",  # 1008: "EMU1"
}
"""Requests and answers; None for what is up to the drive."""

SET_UP = (
    "2B40600002000000",  # 6040 := 0002 quick stop, should the drive still be under power
    "2B07600000000000",  # 6007 := 0, the watchdog off while nobody sends heartbeats
    "2316100100000000",  # 1016:01 := 0
    "2301140101030080",  # 1401:01 := 80000301, the maker's own PDOs off
    "2301180181020080",  # 1801:01 := 80000281
    "2302140101040080",
    "2302180181030080",
    "2303140101050080",
    "2303180181040080",
    "2300140101020080",  # 1400:01 := 80000201, off while it is mapped
    "2F00160000000000",  # 1600:00 := 0
    "2300160110004060",  # 1600:01 := 60400010
    "2300160220007A60",  # 1600:02 := 607A0020
    "2F00160002000000",  # 1600:00 := 2
    "2F00140201000000",  # 1400:02 := 1, acts at the next SYNC
    "2300140101020000",  # 1400:01 := 00000201
    "2300180181010080",  # 1800:01 := 80000181
    "2F001A0000000000",
    "23001A0110004160",  # 1A00:01 := 60410010
    "23001A0220006460",  # 1A00:02 := 60640020
    "23001A0308006160",  # 1A00:03 := 60610008
    "2F001A0003000000",
    "2F00180201000000",  # 1800:02 := 1, sent at every SYNC
    "2300180181010000",  # 1800:01 := 00000181
    "2B17100032000000",  # 1017 := 50 ms
    "2FC2600147000000",  # 60C2:01 := 71
    "2FC26002FC000000",  # 60C2:02 := -4, together 7.1 ms
    "2B5A600006000000",  # 605A := 6, stay in quick stop
    "2385600030E60200",  # 6085 := 190000 counts/s2
    "2F60600008000000",  # 6060 := 8, cyclic synchronous position
    "4061600000000000",  # read 6061
)
"""Downloads in their order, and one upload at the end."""

WATCHDOG_ON = "2B07600003000000", "2316100164007E00"
"""6007 := 3, quick stop when the host is lost; 1016:01 := node 126 within 100 ms."""
WATCHDOG_OFF = "2B07600000000000", "2316100100000000"

REFUSED = {
    "2F00160003000000": 0x0800_0022,  # 1600:00 while its PDO is valid
    "4099900000000000": 0x0602_0000,  # no such object
    "4018100900000000": 0x0609_0011,  # no such sub-index
    "2B41600000000000": 0x0601_0002,  # the statusword is read only
    "2F40600000000000": 0x0607_0010,  # one byte for two
    "2F60600001000000": 0x0609_0030,  # a mode that it does not have
    "C000000000000000": 0x0504_0001,  # block transfer
}
"""Requests of which nothing comes but an abort code."""

STATUSWORDS = {
    "NOT_READY": (0x0200, 0x0000, 0x0090, 0x0020),
    "SWITCH_ON_DISABLED": (0x0240, 0x0040, 0x0250, 0x0660, 0x02F0),
    "READY": (0x0231, 0x0021, 0x16B1),
    "SWITCHED_ON": (0x0233, 0x0023, 0x16B3),
    "ENABLED": (0x1237, 0x0027, 0x0237, 0x1637, 0x12B7),
    "QUICK_STOP": (0x0217, 0x0007, 0x1617),
    "FAULT_REACTION": (0x021F, 0x000F, 0x022F),
    "FAULT": (0x0208, 0x0008, 0x0238),
    "": (0x0001, 0x0025, 0x0002, 0x004F),
}
"""By state, as drives send them: with voltage, remote, target and warning bits set or not; first the emulator's."""
