"""Instance AP: hand-computed cases of both protocols, and an independent implementation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from faster_coco_eval import COCO, COCOeval_faster
from faster_coco_eval.core import mask
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo_lab.evaluate.coco_ap import COCO_THRESHOLDS, average_precision, coco_ap, exact_ap
from walltopo_lab.evaluate.instances import evaluate_instances, summarise_instances
from walltopo_lab.evaluate.overlap import Labelled, Overlap, overlap_of_faces, overlap_of_sets
from walltopo_lab.evaluate.scannet import SCANNET_THRESHOLDS, scannet_ap


def faces(*runs: tuple[int, int]) -> NDArray[np.int32]:
    """Labels from (id, count) runs."""
    return np.concatenate([np.full(count, label) for label, count in runs]).astype(np.int32)


def of(runs: list[tuple[int, int]], scores: dict[int, float] | None = None) -> Labelled:
    array = faces(*runs)
    return Labelled(array, {int(i): 1 for i in np.unique(array)}, scores)


def agnostic(predicted: Labelled, truth: Labelled, **kwargs: Any) -> Any:
    weights = np.ones(len(truth.face_instance))
    return evaluate_instances(predicted, truth, weights, **kwargs).agnostic


def sets(
    predicted: list[list[int]], truth: list[list[int]], scores: list[float], n: int
) -> Overlap:
    def matrix(rows: list[list[int]]) -> NDArray[np.float64]:
        result = np.zeros((len(rows), n))
        for k, row in enumerate(rows):
            result[k, row] = 1
        return result

    return overlap_of_sets(
        matrix(predicted),
        matrix(truth),
        np.ones(n),
        np.array(scores, dtype=float),
        np.ones(len(predicted), dtype=np.int64),
        np.ones(len(truth), dtype=np.int64),
    )


def test_perfect_is_one() -> None:
    truth = of([(1, 10), (0, 5), (2, 7)])
    result = agnostic(truth, truth)
    assert (result.ap, result.ap50, result.ap25) == (1.0, 1.0, 1.0)
    assert result.coco_ap == pytest.approx(1.0)
    assert (result.truth, result.predicted) == (2, 2)


def test_overlap_at_the_threshold_counts_for_coco_only() -> None:
    truth = of([(1, 10), (0, 10)])
    half = of([(1, 5), (0, 15)])  # IoU is exactly .5
    result = agnostic(half, truth)
    assert result.ap50 == 0.0
    assert result.coco_ap50 == pytest.approx(1.0)
    assert result.ap25 == 1.0


def test_hand_computed_curve() -> None:
    """Three truths; scores .9 hit, .8 false, .7 hit; one truth is missed."""
    truth = of([(1, 10), (2, 10), (3, 10), (0, 10)])
    found = of([(1, 10), (3, 10), (0, 10), (2, 10)], {1: 0.9, 2: 0.8, 3: 0.7})
    result = agnostic(found, truth)
    # ScanNet: points (precision, recall) from the lowest confidence: (2/3, 2/3), (1/2, 1/3),
    # (1, 1/3), (1, 0); steps (r[i-1] - r[i+1]) / 2 with the ends repeated.
    recall = [2 / 3, 2 / 3, 1 / 3, 1 / 3, 0, 0]
    precision = [2 / 3, 1 / 2, 1, 1]
    expected = sum(p * (recall[i] - recall[i + 2]) / 2 for i, p in enumerate(precision))
    assert result.ap50 == pytest.approx(expected)
    # COCO: precision 1 up to recall 1/3 (34 of 101 points), 2/3 up to 2/3 (33 points), then 0.
    assert result.coco_ap50 == pytest.approx((34 * 1 + 33 * 2 / 3) / 101)


def test_duplicate_on_one_truth() -> None:
    """Two predictions over .25 of one truth: the lower-scored one is false."""
    truth = of([(1, 10), (0, 2)])
    found = of([(1, 6), (2, 4), (0, 2)], {1: 0.5, 2: 0.9})
    result = agnostic(found, truth)
    # The .9 one is the hit at .25, so precision is 1 at full recall.
    assert result.ap25 == pytest.approx(0.5 * 0.5 * (1 - 1) + 1 * 0.5 * 1 + 1 * 0.5 * 1)
    assert result.coco_ap25 == pytest.approx(1.0)
    # At .5 only prediction 1 (IoU .6) hits, and the higher-scored other one is false.
    assert result.coco_ap50 == pytest.approx(0.5)


def test_second_prediction_may_serve_another_truth_in_scannet() -> None:
    scene = sets([[0, 1, 2], [2, 3, 4]], [[0, 1, 2, 3], [3, 4]], [0.9, 0.8], 5)
    # Truth 0 overlaps both (3/4 and 2/5), truth 1 only prediction 1 (2/3).
    assert scannet_ap([scene], [0.25])[0] < 1.0  # prediction 1 is listed twice
    assert coco_ap([scene], [0.25])[0] == pytest.approx(1.0)


def test_equal_confidences_are_one_point_in_scannet() -> None:
    truth = of([(1, 4), (0, 4)])
    hit_first = of([(1, 4), (2, 4)], {1: 0.5, 2: 0.5})
    hit_last = of([(2, 4), (1, 4)], {1: 0.5, 2: 0.5})
    assert agnostic(hit_first, truth).ap50 == agnostic(hit_last, truth).ap50 == 0.75
    # COCO keeps the given order of equals.
    assert agnostic(hit_first, truth).coco_ap50 == pytest.approx(1.0)
    assert agnostic(hit_last, truth).coco_ap50 == pytest.approx(0.5)


def test_empty_sets() -> None:
    nothing, something = of([(0, 4)]), of([(1, 4)])
    missed = agnostic(nothing, something)
    assert (missed.ap, missed.coco_ap, missed.truth) == (0.0, 0.0, 1)
    assert np.isnan(agnostic(something, nothing).ap)
    assert np.isnan(agnostic(nothing, nothing).coco_ap)
    assert agnostic(nothing, nothing).as_dict()["ap"] is None


def test_class_without_truth_is_left_out_of_the_mean() -> None:
    truth = Labelled(faces((1, 4), (0, 4)), {1: 1})
    found = Labelled(faces((1, 4), (2, 4)), {1: 1, 2: 2})
    result = evaluate_instances(found, truth, np.ones(8))
    assert np.isnan(result.per_class[2].ap)
    assert result.mean.ap == result.per_class[1].ap == 1.0
    assert result.agnostic.ap50 == 0.75


def test_wrong_class_is_a_miss_per_class_only() -> None:
    truth = Labelled(faces((1, 4), (2, 4)), {1: 1, 2: 2})
    found = Labelled(faces((1, 4), (2, 4)), {1: 2, 2: 2})
    result = evaluate_instances(found, truth, np.ones(8))
    assert result.agnostic.ap == 1.0
    assert result.per_class[1].ap == 0.0


def test_ignored_faces_count_nowhere() -> None:
    truth = of([(1, 10), (2, 5), (0, 5)])
    found = of([(1, 5), (0, 10), (3, 5)])
    unseen = faces((0, 5), (1, 15)).astype(np.bool_)
    result = agnostic(found, truth, ignored=unseen)
    assert result.ap == result.coco_ap == pytest.approx(1.0)
    assert (result.truth, result.predicted) == (1, 1)


def test_void_excuses_a_false_prediction_mostly_inside() -> None:
    truth = of([(1, 10), (0, 10)])
    found = of([(1, 10), (2, 10)], {1: 0.5, 2: 0.9})
    void = faces((0, 12), (1, 8)).astype(np.bool_)
    assert agnostic(found, truth).ap50 == 0.25
    at_50_to_75 = scannet_ap([overlap_of_faces(found, truth, np.ones(20), void=void)])
    assert at_50_to_75[:6].tolist() == [1.0] * 6  # .8 of it is void: excused below .8
    assert at_50_to_75[-1] < 1.0


def test_small_truth_is_ignored_only_on_request() -> None:
    truth = of([(1, 10), (2, 2), (0, 3)])
    found = of([(1, 10), (0, 5)])
    assert agnostic(found, truth).ap < 1.0
    assert agnostic(found, truth, min_size=3.0).ap == 1.0
    # A prediction on the small one is then no false one either.
    both = of([(1, 10), (2, 2), (0, 3)], {1: 0.1, 2: 0.9})
    result = agnostic(both, truth, min_size=3.0)
    assert result.ap == 1.0
    assert result.coco_ap == pytest.approx(1.0)


def test_areas_weigh_faces() -> None:
    truth, found = of([(1, 2), (0, 1)]), of([(1, 1), (0, 2)])
    areas = np.array([9.0, 1.0, 5.0])
    result = evaluate_instances(found, truth, areas).agnostic
    assert result.ap == pytest.approx(8 / 9)  # IoU .9 is not over .9
    assert result.coco_ap90 == pytest.approx(1.0)


def test_scenes_are_pooled() -> None:
    perfect = overlap_of_faces(of([(1, 4)]), of([(1, 4)]), np.ones(4))
    missed = overlap_of_faces(of([(0, 4)]), of([(1, 4)]), np.ones(4))
    pooled = summarise_instances([perfect, missed]).agnostic
    assert pooled.ap == pytest.approx(0.5)
    assert pooled.coco_ap == pytest.approx(51 / 101)


def test_lengths_must_agree() -> None:
    with pytest.raises(InputError, match="faces"):
        overlap_of_faces(of([(1, 4)]), of([(1, 5)]), np.ones(4))
    with pytest.raises(InputError, match="class"):
        Labelled(faces((3, 1)), {})


def literal_scannet(scene: Overlap, threshold: float) -> float:
    """The loops of `evaluate_semantic_instance.py`, as printed there."""
    iou = scene.iou()
    visited = np.zeros(len(scene.pred_sizes), dtype=bool)
    true, score, match = [1.0] * iou.shape[1], [-np.inf] * iou.shape[1], [False] * iou.shape[1]
    missed = 0
    for g in range(iou.shape[1]):
        found = False
        for p in range(iou.shape[0]):
            if visited[p] or not iou[p, g] > threshold:
                continue
            confidence = float(scene.pred_scores[p])
            if match[g]:
                high, low = max(score[g], confidence), min(score[g], confidence)
                score[g] = high
                true.append(0.0)
                score.append(low)
                match.append(True)
            else:
                found = match[g] = True
                score[g] = confidence
                visited[p] = True
        missed += not found
    y_true = [v for v, m in zip(true, match, strict=True) if m]
    y_score = [v for v, m in zip(score, match, strict=True) if m]
    for p in range(iou.shape[0]):
        if not (iou[p] > threshold).any():
            y_true.append(0.0)
            y_score.append(float(scene.pred_scores[p]))
    if not y_score:  # the printed code skips a class without predictions
        return 0.0
    order = np.argsort(y_score)
    scores, hits = np.array(y_score)[order], np.array(y_true)[order]
    cumulative = np.append(np.cumsum(hits), 0)
    total = cumulative[-2]
    _, first = np.unique(scores, return_index=True)
    precision, recall = [], []
    for index in first:
        below = cumulative[index - 1]
        tp = total - below
        fp = len(scores) - index - tp
        precision.append(tp / (tp + fp))
        recall.append(tp / (tp + below + missed))
    precision.append(1.0)
    recall.append(0.0)
    padded = np.append(np.append(recall[0], recall), 0.0)
    return float(np.dot(precision, np.convolve(padded, [-0.5, 0, 0.5], "valid")))


def random_scene(seed: int) -> tuple[Overlap, NDArray[np.bool_], NDArray[np.bool_]]:
    """Overlapping predictions and truths on a line of elements, with equal scores among them."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(20, 60))
    spans = [
        (int(a), int(w)) for a, w in zip(rng.integers(0, n, 9), rng.integers(3, 15, 9), strict=True)
    ]
    truth = np.zeros((int(rng.integers(1, 8)), n), dtype=np.bool_)
    predicted = np.zeros((int(rng.integers(1, 10)), n), dtype=np.bool_)
    for row in truth:
        start, width = spans[rng.integers(9)]
        row[start : start + width] = True
    for row in predicted:
        start, width = spans[rng.integers(9)]
        row[max(0, start + int(rng.integers(-1, 2))) : start + width] = True
    truth = truth[truth.any(axis=1)]
    predicted = predicted[predicted.any(axis=1)]
    scores = rng.integers(1, 6, len(predicted)) / 5
    ones = np.ones(len(truth), dtype=np.int64)
    overlap = overlap_of_sets(
        predicted, truth, np.ones(n), scores, np.ones(len(predicted), np.int64), ones
    )
    return overlap, predicted, truth


@given(seed=st.integers(0, 100_000), threshold=st.sampled_from([*SCANNET_THRESHOLDS, 0.25]))
@settings(max_examples=200, deadline=None)
def test_scannet_equals_the_printed_loops(seed: int, threshold: float) -> None:
    scene, _, _ = random_scene(seed)
    assert scannet_ap([scene], [threshold])[0] == pytest.approx(literal_scannet(scene, threshold))


def faster_coco_ap(scene: Overlap, predicted: NDArray[np.bool_], truth: NDArray[np.bool_]) -> Any:
    """AP per threshold by faster-coco-eval, each instance an n x 1 image."""

    def annotation(number: int, row: NDArray[np.bool_], **more: Any) -> dict[str, Any]:
        rle = mask.encode(np.asfortranarray(row[:, None].astype(np.uint8)))
        common = {"id": number, "image_id": 1, "category_id": 1, "iscrowd": 0, "segmentation": rle}
        return {**common, "area": int(row.sum()), "bbox": [0, 0, 1, len(row)], **more}

    data: dict[str, Any] = {
        "images": [{"id": 1, "height": truth.shape[1], "width": 1}],
        "categories": [{"id": 1, "name": "hold"}],
        "annotations": [annotation(k + 1, row) for k, row in enumerate(truth)],
    }
    results = [
        annotation(k + 1, row, score=float(scene.pred_scores[k])) for k, row in enumerate(predicted)
    ]
    reference = COCO(data)
    evaluation = COCOeval_faster(reference, reference.loadRes(results), "segm")
    evaluation.params.maxDets = [1000]
    evaluation.params.areaRng = [[0, 1e10]]
    evaluation.params.areaRngLbl = ["all"]
    evaluation.params.iouThrs = np.array(COCO_THRESHOLDS)
    evaluation.evaluate()
    evaluation.accumulate()
    return evaluation.eval["precision"][:, :, 0, 0, 0].mean(axis=1)


@pytest.mark.parametrize("seed", range(40))
def test_coco_equals_faster_coco_eval(seed: int) -> None:
    scene, predicted, truth = random_scene(seed)
    expected = faster_coco_ap(scene, predicted, truth)
    assert coco_ap([scene], COCO_THRESHOLDS) == pytest.approx(expected)


def test_average_precision_by_hand() -> None:
    scores = np.array([0.9, 0.8, 0.7, 0.6])
    hits = np.array([True, False, True, False])
    # Recall 0 to .5 at precision 1, to 1 at 2/3 (101 points: 51 and 50).
    assert average_precision(scores, hits, 2) == pytest.approx((51 + 50 * 2 / 3) / 101)
    assert average_precision(np.zeros(0), np.zeros(0, bool), 3) == 0


@given(seed=st.integers(0, 100_000))
@settings(max_examples=100, deadline=None)
def test_ap_falls_as_the_threshold_rises_when_sets_are_disjoint(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = (np.repeat(rng.integers(0, 6, 12), 5).astype(np.int32) for _ in range(2))
    scene = overlap_of_faces(
        Labelled(a, dict.fromkeys(range(1, 6), 1), {i: i / 6 for i in range(1, 6)}),
        Labelled(b, dict.fromkeys(range(1, 6), 1)),
        rng.random(60),
    )
    for protocol in (scannet_ap, coco_ap):
        values = protocol([scene], COCO_THRESHOLDS)
        if not np.isnan(values).any():
            assert (np.diff(values) <= 1e-9).all()
            assert (values >= 0).all()
            assert (values <= 1 + 1e-12).all()


def test_over_every_recall_that_is_reached() -> None:
    """A hit, a miss, a hit; two true objects: precision 1 and 2/3 at the two recalls."""
    found = Labelled(np.array([1, 2, 0, 3], np.int32), {1: 1, 2: 1, 3: 1}, {1: 0.9, 2: 0.8, 3: 0.7})
    truth = Labelled(np.array([1, 0, 0, 2], np.int32), {1: 1, 2: 1})
    scene = overlap_of_faces(found, truth, np.ones(4))
    assert exact_ap([scene], [0.5, 0.9]) == pytest.approx([(1 + 2 / 3) / 2] * 2)
    assert coco_ap([scene], [0.5])[0] == pytest.approx((51 + 50 * 2 / 3) / 101)
