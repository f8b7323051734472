"""The learning core: ports, perception, policies, control, and the insertion task.

It does no I/O and reads no clock; :mod:`palpate.core.control_loop` runs it over the four ports of
:mod:`palpate.core.ports.devices`. Modules are imported by name
(``from palpate.core.insertion.task import InsertionTask``), so that a program pays only for what it uses.
"""
