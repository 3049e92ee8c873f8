"""Bytes -> frames that can be trusted: check, order, gaps, reboots, reopening."""

from probe.client.client import Client
from probe.client.statistics import ClientStatistics

__all__ = ["Client", "ClientStatistics"]
