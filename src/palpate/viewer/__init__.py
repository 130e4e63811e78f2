"""In the eye: a page that shows the body deform and lets a hand pull on it, and one to look at solved bodies.

=================  ====================================================================================
`server`           `serve` and `Viewer`: the page, its websocket and the real-time process behind them
`session`          the pages of one server: credits, frames, heartbeats
`hand_lock`        which of several pages holds the hand
`page_model`       a touchable body as its pages see it; drawn as a line
`surface_drawing`  drawn as a surface; `surfaces`: its mesh; `indentation_drawing`: what stays on it
`part_page`        `serve_part` and `PartPage`: a part is set up, solved, learnt and touched on one page
`shown_part`       that part, and a person's choices; `part_messages`: its messages; `solve_dots`: places of solves
`trust_map`        how well the force is known over the touched surface
`messages`         every message between server and page, as dataclasses that generate the TypeScript
`wire`             how those dataclasses become bytes; `typescript`: how they become TypeScript
`body_viewer`      `show` and `BodyViewer`: the page of a solved body
`shown_body`       that body as plain arrays, of solutions, VTU, PVD or datasets
`web_server`       a server for this machine alone: its port, its thread, the page's way into the browser
`guard`            who is let in: Host, Origin and token; `traffic`: fair shares, rates, limits of connections
`answer_viewer`    `show_answers`: the page of a surrogate without touch; `answer_page`: its parts, and one HTML file
``client/``        the page's sources (TypeScript, three.js); ``static/`` is what they build to
=================  ====================================================================================

The built page is under version control, so that installing needs no node. After a change in ``client/``:

    npm ci && npm run build        # in src/palpate/viewer/client
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
