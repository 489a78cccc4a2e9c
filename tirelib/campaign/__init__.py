"""Campaigns: folders of measurements in the format ``tirelib-campaign/1``."""

from tirelib.campaign.campaign_fault import CampaignFault
from tirelib.campaign.check import check_campaign
from tirelib.campaign.conditions import conditions_of
from tirelib.campaign.model import (
    BoolArray,
    CampaignHeader,
    FloatArray,
    Run,
    RunPlan,
    TireGeometry,
    Tolerance,
)
from tirelib.campaign.read import Campaign, read_campaign
from tirelib.campaign.write import write_campaign

__all__ = [
    "BoolArray",
    "Campaign",
    "CampaignFault",
    "CampaignHeader",
    "FloatArray",
    "Run",
    "RunPlan",
    "TireGeometry",
    "Tolerance",
    "check_campaign",
    "conditions_of",
    "read_campaign",
    "write_campaign",
]
