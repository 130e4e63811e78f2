// The entry of every page. The server says which one it is: of a touched body, of a solved one that is looked at, of a part
// that is set up and learnt, of an examination, or of a surrogate that answers inputs and is not touched.

import { answers } from "./answers";
import { joinServer } from "./connection";
import { exam } from "./exam";
import { part } from "./part";
import { shown } from "./shown";
import { touch } from "./touch";

const mode = document.documentElement.dataset["mode"];
if (mode === "shown") shown();
else if (mode === "part") part();
else if (mode === "exam") exam();
else if (mode === "answers") answers();
else touch({ connect: joinServer });
