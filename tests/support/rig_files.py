"""Rig files for tests, as ``palpate rig new`` prints them."""

from palpate.adapters.cli.rig_new import rig_text


def zebra_rig(path):
    """Write the rig file of a Zebra Zero with a JR3, whose devices are not there."""
    path.write_text(rig_text("zebra-nmc", "jr3-can", "zebra-zero"), encoding="utf-8")
    return path
