"""Perception: signal processing -> features -> symbols -> state, each stage interchangeable."""

from palpate.core.perception.channels import CHANNELS
from palpate.core.perception.features import (
    FeatureExtractor,
    PrincipalComponents,
    SelectedChannels,
    SelfOrganisingMap,
)
from palpate.core.perception.history import LastSymbols
from palpate.core.perception.normalisation import Normalisation
from palpate.core.perception.partitions import Clusters, RandomPartition
from palpate.core.perception.pipeline import Perception
from palpate.core.perception.signal import SignalProcessor, Wrench
from palpate.core.perception.stages import (
    SCHEMA,
    load_perception,
    perception_from_dict,
    perception_to_dict,
    register_stage,
    save_perception,
    stage_from_dict,
    stage_to_dict,
)
from palpate.core.perception.state import IdentityState, StateIdentifier
from palpate.core.perception.symbols import GatedThresholds, Symboliser, Thresholds

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
    "load_perception",
    "perception_from_dict",
    "perception_to_dict",
    "register_stage",
    "save_perception",
    "stage_from_dict",
    "stage_to_dict",
]
