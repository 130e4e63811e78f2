"""In the eye: a page that shows the body deform and lets a hand pull on it, and one to look at solved bodies.

==============  ====================================================================================
`server`        `serve` and `Viewer`: the page, its websocket and the real-time process behind them
`messages`      every message between server and page, as dataclasses that generate the TypeScript
`wire`          how those dataclasses become bytes
`typescript`    how they become TypeScript
`hands`         which of several pages holds the hand
`picture`       from a published tick to a frame, including the spring-back after release
`session`       the pages of one server: credits, frames, heartbeats
`showing`       `show` and `BodyViewer`: the page of a solved body
`bodies`        from solutions to plain arrays; `files`: from VTU, PVD and datasets; `surfaces`: their skin
`running`       a web application in a thread of its own
`guard`         Host, Origin and content-security rules
`ports`         a free port on this machine
``client/``     the page's sources (TypeScript, three.js); ``static/`` is what they build to
==============  ====================================================================================

The built page is under version control, so that installing needs no node. After a change in ``client/``:

    npm ci && npm run build        # in src/palpate/viewer/client
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
