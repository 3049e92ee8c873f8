"""Where bytes come from: a serial line, a simulated probe, a recording."""
