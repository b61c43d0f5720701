"""The endpoint of the MCP server (streamable HTTP, answers in JSON).

It takes tokens alone, those of apps or of people, and reads no cookie. So no page can use it that
was not given a token, and the check of `Origin` that MCP asks for has nothing to protect.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Request, Response
from starlette.responses import JSONResponse

from walltopo_gym.accounts.access import Rule, actor_in, check_scope
from walltopo_gym.accounts.actor import NOBODY
from walltopo_gym.api.error_responses import error_response
from walltopo_gym.api.services import ServicesOf, token_of
from walltopo_gym.assistants.protocol import VERSIONS, answer
from walltopo_gym.assistants.tools import Caller, Tool
from walltopo_gym.errors import RequestError, SignInNeededError

_root = APIRouter(include_in_schema=False)
ROUTERS: Final[tuple[APIRouter, ...]] = ()
ROOT_ROUTERS: Final[tuple[APIRouter, ...]] = (_root,)


async def _read_body(request: Request) -> bytes:
    return await request.body()


@_root.post("/mcp")
def answer_message(
    content: Annotated[bytes, Depends(_read_body)], request: Request, services: ServicesOf
) -> Response:
    """Answer a message of an assistant."""
    wanted = request.headers.get("mcp-protocol-version", VERSIONS[0])
    if wanted not in VERSIONS:
        return JSONResponse({"title": f"versions are {', '.join(VERSIONS)}", "status": 400}, 400)
    with services.database.reading() as session:
        try:
            actor = NOBODY if token_of(request.headers) is None else actor_in(session, request)
            _ = actor.known
        except SignInNeededError as error:
            return _refusal_response(error, services.settings.link_base)

        def run(tool: Tool, arguments: Any) -> Mapping[str, Any]:
            check_scope(actor, Rule("signed-in", tool.scope))
            return tool.run(Caller(session, actor, request), arguments)

        found = answer(content, run)
    if found is None:
        return Response(status_code=202)
    is_refused = "error" in found and found["id"] is None
    return JSONResponse(found, 400 if is_refused else 200)


@_root.api_route("/mcp", methods=["GET", "DELETE"])
def refuse_stream() -> Response:
    """Say that there is neither a stream nor a session here."""
    return Response(status_code=405, headers={"allow": "POST"})


def _refusal_response(error: RequestError, base: str) -> Response:
    """Return the refusal that says where tokens come from (RFC 9728)."""
    described = f"{base}/.well-known/oauth-protected-resource/mcp"
    headers = {"www-authenticate": f'Bearer resource_metadata="{described}", scope="read"'}
    return error_response(error, 401, headers)
