"""Emulation of a robot with ros2_control: joint angles, wrenches, and a forward_command_controller."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
