"""The names of a cell's topics, and those of runs."""

from __future__ import annotations

from scbm.nodes.links.link import Correlation
from scbm.nodes.links.topic_link import id_text, read_id
from scbm.nodes.roles.cell_topics import CellTopics, is_of_tester, new_run
from support.models import scan_cell

MODEL = scan_cell(("behavior_model: scan_cell", "behavior_model: plant.scan_cell"))


def test_topics_are_below_the_name_of_the_model_and_dots_are_levels() -> None:
    topics = CellTopics.of(MODEL)
    names = [topics.status, topics.case, topics.run, topics.simulated, topics.request("arm.left"), topics.reply("arm")]
    assert [topic.name for topic in names] == [
        "/scbm/plant/scan_cell/status",
        "/scbm/plant/scan_cell/case",
        "/scbm/plant/scan_cell/run",
        "/scbm/plant/scan_cell/simulated",
        "/scbm/plant/scan_cell/arm/left/request",
        "/scbm/plant/scan_cell/arm/reply",
    ]


def test_only_who_is_there_is_latched() -> None:
    topics = CellTopics.of(MODEL)
    assert topics.status.is_latched
    others = [topics.case, topics.run, topics.simulated, topics.request("scan"), topics.reply("scan")]
    assert not any(topic.is_latched for topic in others)


def test_each_run_has_an_id_of_its_own_that_is_part_of_the_ids_of_its_requests() -> None:
    runs = [new_run() for _ in range(100)]
    assert len(dict.fromkeys(runs)) == 100
    assert all(is_of_tester(run) for run in runs)
    request = Correlation(runs[0], 7)
    assert read_id(id_text(request)) == request
    assert not is_of_tester("another")
