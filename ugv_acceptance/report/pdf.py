"""The report as PDF: WeasyPrint, an extra, over Debian's Pango; nothing is fetched."""

import logging
from typing import Any

from ugv_acceptance import AcceptanceError, pip_install


def pdf_of(html: str) -> bytes:
    """Return the page as a PDF file's bytes. Raises AcceptanceError where WeasyPrint is absent."""
    try:
        import weasyprint  # noqa: PLC0415 - an extra
    except (ImportError, OSError) as error:
        reason = str(error).splitlines()[0]
        raise AcceptanceError(
            f'no PDF: expected WeasyPrint ({pip_install("pdf")}) and Pango '
            f'(apt install libpango-1.0-0 libpangoft2-1.0-0), got: {reason}'
        ) from None
    logging.getLogger('weasyprint').setLevel(logging.ERROR)
    document: bytes = weasyprint.HTML(string=html, url_fetcher=_nothing).write_pdf()
    return document


def _nothing(url: str, *_: Any, **__: Any) -> Any:  # noqa: ANN401 - WeasyPrint's protocol
    raise ValueError(f'a report refers to nothing outside itself, got {url}')
