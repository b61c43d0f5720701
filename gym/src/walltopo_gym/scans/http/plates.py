"""Endpoints of the scale plates and stickers to print."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Path, Request, Response

from walltopo.reconstruct.scale.plate_pdf import PAPERS, draw_plate, draw_stickers, to_pdf
from walltopo.reconstruct.scale.plates import built_in_plates
from walltopo_gym.accounts.access import AnyoneMay
from walltopo_gym.api.documents import document_response
from walltopo_gym.api.fields import Digits
from walltopo_gym.errors import NotFoundError

router = APIRouter(tags=["scans"])

_PDF: Final = "application/pdf"
Paper = Literal["a4", "a3", "letter"]


_ANSWER: Final[dict[int | str, dict[str, Any]]] = {
    200: {"content": {_PDF: {"schema": {"type": "string", "format": "binary"}}}}
}


@router.get(
    "/scale-plates/{paper}/{number}.pdf",
    response_class=Response,
    responses=_ANSWER,
)
def read_scale_plate(
    request: Request,
    actor: AnyoneMay,
    paper: Paper,
    number: Annotated[Digits, Path(ge=1, le=9)],
) -> Response:
    """Return a scale plate to print at 100 %. Plates in one scan need different numbers."""
    kinds = [plate for plate in built_in_plates() if plate.name == paper]
    if number > len(kinds):
        raise NotFoundError("no-such-plate", paper=paper, most=len(kinds))
    plate = kinds[number - 1]
    pdf = to_pdf([draw_plate(plate, PAPERS[paper])], PAPERS[paper], f"walltopo {plate.label}")
    return document_response(request, pdf, _PDF, f"scale-plate-{paper}-{number}.pdf", shown=True)


@router.get(
    "/stickers/{paper}/{count}.pdf",
    response_class=Response,
    responses=_ANSWER,
)
def read_stickers(
    request: Request,
    actor: AnyoneMay,
    paper: Paper,
    count: Annotated[Digits, Path(ge=1, le=587)],
) -> Response:
    """Return sheets of stickers for bare walls, to print at 100 % and cut."""
    pdf = to_pdf(draw_stickers(range(count), PAPERS[paper]), PAPERS[paper], "walltopo stickers")
    return document_response(request, pdf, _PDF, f"stickers-{paper}-{count}.pdf", shown=True)
