"""About how many touches name a place."""

from generator.array.contract import touches_needed


def test_profiles_are_read_by_as_many_touches_as_was_measured():
    assert touches_needed(2, 63 * 65, 12.0) == 8  # thesis
    assert touches_needed(8, 15 * 15, 15.0) == 5  # product, of the 80 mm cube
    assert touches_needed(4, 63 * 65, 7.0) == 1  # one-touch
    assert touches_needed(4, 1 << 62, 7.0) == touches_needed(4, 1 << 20, 7.0)


def test_larger_sensors_and_closer_symbols_need_fewer():
    by_pitch = [touches_needed(2, 4095, pitch) for pitch in (5.0, 8.0, 12.0, 16.0)]
    assert by_pitch == sorted(by_pitch)
    assert touches_needed(2, 4095, 12.0, sensor_mm=50.0) == 1
