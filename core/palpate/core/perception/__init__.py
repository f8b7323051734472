"""Perception: signal processing -> features -> symbols -> state, each stage interchangeable."""

from palpate.core.perception.features import FeatureExtractor, PrincipalComponents, SelectedChannels, SelfOrganisingMap
from palpate.core.perception.pipeline import (
    SCHEMA,
    Perception,
    perception_from_dict,
    perception_to_dict,
    register_stage,
    stage_from_dict,
    stage_to_dict,
)
from palpate.core.perception.signal import Normalisation, SignalProcessor, Wrench
from palpate.core.perception.state import IdentityState, LastSymbols, StateIdentifier
from palpate.core.perception.symbols import Clusters, GatedThresholds, RandomPartition, Symboliser, Thresholds
from palpate.core.ports.kinds import CHANNELS

__all__ = [
    "CHANNELS",
    "SCHEMA",
    "Clusters",
    "FeatureExtractor",
    "GatedThresholds",
    "IdentityState",
    "LastSymbols",
    "Normalisation",
    "Perception",
    "PrincipalComponents",
    "RandomPartition",
    "SelectedChannels",
    "SelfOrganisingMap",
    "SignalProcessor",
    "StateIdentifier",
    "Symboliser",
    "Thresholds",
    "Wrench",
    "perception_from_dict",
    "perception_to_dict",
    "register_stage",
    "stage_from_dict",
    "stage_to_dict",
]
