"""Names of hosts as the DNS, mails and browsers' origins have them: in ASCII (IDNA 2008)."""

from __future__ import annotations

from urllib.parse import quote, urlsplit, urlunsplit

_KEPT = "%/:?#[]@!$&'()*+,;=~"  # characters with a meaning in an address (RFC 3986)


def ascii_domain(domain: str) -> str:
    """Return a domain in ASCII: "köln.example" is "xn--kln-sna.example".

    Raises
    ------
    ValueError : it is not a domain.
    """
    if domain.isascii():
        return domain
    import idna

    try:
        return idna.encode(domain, uts46=True).decode("ascii")
    except idna.IDNAError as error:
        raise ValueError(f"{domain} is not a domain ({error})") from error


def ascii_url(url: str) -> str:
    """Return a web address in ASCII; other characters of path and query are percent-encoded.

    Raises
    ------
    ValueError : it is not an address, or its host is not a domain.
    """
    if url.isascii():
        return url
    parts = urlsplit(url)
    host = ascii_domain(parts.hostname or "")
    user, at, _ = parts.netloc.rpartition("@")
    port = "" if parts.port is None else f":{parts.port}"
    rest = (quote(part, safe=_KEPT) for part in (parts.path, parts.query, parts.fragment))
    return urlunsplit((parts.scheme, f"{user}{at}{host}{port}", *rest))


def ascii_mail(address: str) -> str:
    """Return a mail address whose domain is in ASCII; mail servers know no other.

    Raises
    ------
    ValueError : the domain is none.
    """
    name, at, domain = address.rpartition("@")
    return name + at + ascii_domain(domain)
