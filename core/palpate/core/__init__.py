"""The learning core: ports, perception, policies, control, and the insertion task.

It does no I/O and reads no clock; :mod:`palpate.core.cycle` runs it over the four ports of
:mod:`palpate.core.ports`. Modules are imported by name (``from palpate.core.insertion import InsertionTask``), so that
a program pays only for what it uses.
"""
