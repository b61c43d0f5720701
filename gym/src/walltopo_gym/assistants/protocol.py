"""The part of MCP that tools without a session need (https://modelcontextprotocol.io).

Written here rather than taken from the package `mcp`: that needs another HTTP client, a server of
events, JSON Schema, OpenTelemetry and JWT, for sessions and streams that nothing here uses.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Mapping
from importlib.metadata import version
from typing import Any, Final

from pydantic import ValidationError

from walltopo.core import WalltopoError
from walltopo_gym.assistants.tools import TOOLS, Tool

_LOG = logging.getLogger("walltopo_gym.assistants")
# The newest first, which is offered to clients that want another one.
VERSIONS: Final = ("2025-06-18", "2025-03-26")
_PARSE: Final = -32700
_REQUEST: Final = -32600
_METHOD: Final = -32601
_PARAMS: Final = -32602
_INTERNAL: Final = -32603
Run = Callable[[Tool, Any], Mapping[str, Any]]


class _RpcError(Exception):
    """An error of JSON-RPC 2.0."""

    def __init__(self, code: int, why: str) -> None:
        super().__init__(why)
        self.code, self.why = code, why


def answer(content: bytes, run: Run) -> dict[str, Any] | None:
    """Return the response to a message of a client; None: it wants none.

    Parameters
    ----------
    run : runs a tool with its checked arguments.
    """
    key: Any = None
    try:
        message = _parse_message(content)
        key = message.get("id")
        method = message.get("method")
        if "id" not in message and isinstance(method, str | None):
            return None  # a notification, or a response, which nobody asked for
        if not isinstance(method, str) or not isinstance(key, str | int):
            raise _RpcError(_REQUEST, "method or id is not valid")
        params = message.get("params", {})
        if not isinstance(params, dict):
            raise _RpcError(_PARAMS, "params must be an object")
        return {"jsonrpc": "2.0", "id": key, "result": _run_method(method, params, run)}
    except _RpcError as error:
        known = key if isinstance(key, str | int) else None
        return {"jsonrpc": "2.0", "id": known, "error": {"code": error.code, "message": error.why}}


def _parse_message(content: bytes) -> dict[str, Any]:
    try:
        message = json.loads(content)
        json.dumps(message, ensure_ascii=False).encode()  # refuses half of a surrogate pair
    except (ValueError, RecursionError) as error:
        raise _RpcError(_PARSE, "the body is not JSON") from error
    if not isinstance(message, dict) or message.get("jsonrpc") != "2.0":
        raise _RpcError(_REQUEST, "the body must be one message of JSON-RPC 2.0")
    return message


def _run_method(method: str, params: dict[str, Any], run: Run) -> dict[str, Any]:
    match method:
        case "initialize":
            wanted = params.get("protocolVersion")
            return {
                "protocolVersion": wanted if wanted in VERSIONS else VERSIONS[0],
                "capabilities": {"tools": {"listChanged": False}},
                "serverInfo": {"name": "walltopo gym", "version": version("walltopo-gym")},
            }
        case "ping":
            return {}
        case "tools/list":
            return {"tools": [_describe_tool(name, tool) for name, tool in TOOLS.items()]}
        case "tools/call":
            return _call_tool(params, run)
    raise _RpcError(_METHOD, f"no method {method[:80]}")


def _describe_tool(name: str, tool: Tool) -> dict[str, Any]:
    return {
        "name": name,
        "title": tool.title,
        "description": tool.about,
        "inputSchema": tool.arguments.model_json_schema(),
        "annotations": {"title": tool.title, "readOnlyHint": True, "openWorldHint": False},
    }


def _call_tool(params: dict[str, Any], run: Run) -> dict[str, Any]:
    tool = TOOLS.get(str(params.get("name")))
    if tool is None:
        raise _RpcError(_PARAMS, "no such tool")
    try:
        arguments = tool.arguments.model_validate(params.get("arguments") or {})
    except ValidationError as error:
        first = error.errors()[0]
        where = " ".join(str(part) for part in first["loc"])
        raise _RpcError(_PARAMS, f"{where}: {first['msg']}") from error
    try:
        found = dict(run(tool, arguments))
    except WalltopoError as error:  # the assistant can do something about it
        text = f"{error.message}. {error.hint}".strip()
        return {"content": [{"type": "text", "text": text}], "isError": True}
    except Exception as error:
        _LOG.exception("a tool failed")
        raise _RpcError(_INTERNAL, "internal error in walltopo gym") from error
    text = json.dumps(found, ensure_ascii=False)
    content = [{"type": "text", "text": text}]
    return {"content": content, "structuredContent": found, "isError": False}
