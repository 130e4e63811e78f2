// The entry of every page. The server says which one it is: of a touched body, of a solved one that is looked at, or of a part
// that is set up and learnt.

import { joinServer } from "./connection";
import { part } from "./part";
import { shown } from "./shown";
import { touch } from "./touch";

const mode = document.documentElement.dataset["mode"];
if (mode === "shown") shown();
else if (mode === "part") part();
else touch({ connect: joinServer });
