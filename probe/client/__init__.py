"""Bytes -> frames that can be trusted: check, order, gaps, reboots, reopening."""

from probe.client.client import Client
from probe.client.receiver import ClientStatistics

__all__ = ["Client", "ClientStatistics"]
