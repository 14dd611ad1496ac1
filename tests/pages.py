"""Pages of reports, as tests read them."""

from html.parser import HTMLParser

VOID = {"meta", "link", "img", "source", "br", "wbr"}
# What loads something, by the attribute that says what.
LOADING = {"src", "srcset", "data", "poster", "background"}


class Read(HTMLParser):
    """A page that is closed properly and loads nothing; its texts by the section they are in."""

    def __init__(self, html):
        super().__init__()
        self.open, self.ids, self.texts, self.links, self.tags = [], [], {}, [], []
        self.feed(html)
        self.close()
        assert not self.open
        assert len(set(self.ids)) == len(self.ids)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.tags.append(tag)
        if "id" in given:
            self.ids.append(given["id"])
        for name in LOADING & set(given):
            assert given[name].startswith("data:image/png;base64,")
        if tag == "link":
            assert given["href"] == "data:,"
        elif tag == "a":
            self.links.append(given["href"])
        elif "href" in given or "xlink:href" in given:
            assert given.get("href", given.get("xlink:href")).startswith("#")
        if tag not in VOID:
            self.open.append((tag, given.get("id")))

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.handle_endtag(tag)

    def handle_endtag(self, tag):
        assert self.open.pop()[0] == tag

    def handle_data(self, data):
        if "style" in (tag for tag, _ in self.open):
            assert "url(" not in data
            assert "@import" not in data
        sections = [name for tag, name in self.open if tag == "section" and name]
        self.texts[sections[-1] if sections else ""] = self.texts.get(sections[-1] if sections else "", "") + data
