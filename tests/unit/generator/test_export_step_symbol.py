"""Templates of symbols shared by panels: in every file as if they were built for it alone."""

import gzip
import re

import numpy as np

from generator.export.step import assembly_chunks, gzip_chunks, step_chunks
from generator.export.step.symbol import _components, _topology, outline_points
from generator.pipeline.files import parts_of
from generator.pipeline.place import place_object
from generator.pipeline.plan import plan_object
from generator.spec import read_specs

CACHES = (_topology, _components, outline_points)


def panels_of(tmp_path):
    spec = tmp_path / "part.yaml"
    spec.write_text("{name: Part, shape: {box: 40 x 40 x 30 mm}, profile: one-touch}")
    plan = plan_object(read_specs([spec])[0])
    return parts_of(plan, place_object(None, plan, replace=False).layout)[0]


def whole_text(chunks):
    return b"".join(chunks)


def test_shared_templates_change_no_byte(tmp_path):
    parts = panels_of(tmp_path)
    alone = []
    for part in parts:
        for cache in CACHES:
            cache.cache_clear()
        alone.append(whole_text(step_chunks(part)))
    for cache in CACHES:
        cache.cache_clear()
    shared = [whole_text(step_chunks(part)) for part in parts]
    assert shared == alone
    for cache in CACHES:
        assert cache.cache_info().hits > 0
    # Outlines with as many points share their entities.
    assert _topology.cache_info().misses < _components.cache_info().misses


def test_every_reference_is_to_an_entity_of_the_file(tmp_path):
    text = whole_text(assembly_chunks("Part", panels_of(tmp_path))).decode()
    assert not set(text) & set(map(chr, range(1, 9)))
    entities = dict(re.findall(r"^(#\d+)=([A-Z_]+)\('',", text, re.MULTILINE))
    assert set(re.findall(r"#\d+", text)) == set(re.findall(r"^#\d+(?==)", text, re.MULTILINE))
    lines = re.findall(r"LINE\('',(#\d+),(#\d+)\)", text)
    assert {entities[a] for a, _ in lines} == {"CARTESIAN_POINT"}
    assert {entities[b] for _, b in lines} == {"VECTOR"}
    axes = re.findall(r"AXIS2_PLACEMENT_3D\('',#\d+,(#\d+),(#\d+)\)", text)
    assert {entities[one] for pair in axes for one in pair} == {"DIRECTION"}
    # every symbol's faces stand on edges whose direction is that of their points
    points = {
        key: np.array(list(map(float, xyz.split(","))))
        for key, xyz in re.findall(r"(#\d+)=CARTESIAN_POINT\('',\(([^)]*)\)\)", text)
    }
    directions = {
        key: np.array(list(map(float, xyz.split(","))))
        for key, xyz in re.findall(r"(#\d+)=DIRECTION\('',\(([^)]*)\)\)", text)
    }
    vectors = dict(re.findall(r"(#\d+)=VECTOR\('',(#\d+),1\.\)", text))
    vertices = dict(re.findall(r"(#\d+)=VERTEX_POINT\('',(#\d+)\)", text))
    curves = dict(re.findall(r"(#\d+)=LINE\('',#\d+,(#\d+)\)", text))
    for a, b, line in re.findall(r"EDGE_CURVE\('',(#\d+),(#\d+),(#\d+),.T.\)", text):
        way = points[vertices[b]] - points[vertices[a]]
        along = directions[vectors[curves[line]]]
        assert np.allclose(way / np.linalg.norm(way), along, atol=1e-8)


def test_gzipped_is_the_same_text_and_the_same_bytes(tmp_path):
    part = panels_of(tmp_path)[0]
    packed = whole_text(gzip_chunks(step_chunks(part)))
    assert gzip.decompress(packed) == whole_text(step_chunks(part))
    assert packed == whole_text(gzip_chunks(step_chunks(part)))
    assert packed[4:8] == bytes(4)  # no date
