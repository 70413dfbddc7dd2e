"""Line drawings as SVG text: a window of the plane in mm, paths, arrows and words in it."""

from xml.sax.saxutils import escape

INK, RED, BLUE, GREY = "#222222", "#c0392b", "#1f5fa8", "#888888"
HEAD_PX = 9.0


class Drawing:
    """A white sheet. window: (x0, y0, x1, y1) of the plane that it shows; width in px, the height follows."""

    def __init__(self, window, width=640):
        self.x0, self.y0, self.x1, self.y1 = window
        self.scale = width / (self.x1 - self.x0)
        self.width, self.height = width, round((self.y1 - self.y0) * self.scale)
        self.parts = []

    def at(self, x, y):
        """Pixels of a point of the plane."""
        return (x - self.x0) * self.scale, (self.y1 - y) * self.scale

    def path(self, points, color=INK, width=1.6, dash=""):
        """A line through points."""
        text = " ".join(f"{x:.1f},{y:.1f}" for x, y in (self.at(*each) for each in points))
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(
            f'<polyline points="{text}" fill="none" stroke="{color}" stroke-width="{width}"{dashes} stroke-linejoin="round"/>'
        )

    def arrow(self, start, end, color=INK, width=1.8):
        """An arrow between two points."""
        (x0, y0), (x1, y1) = self.at(*start), self.at(*end)
        length = ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5
        ux, uy = (x1 - x0) / length * HEAD_PX, (y1 - y0) / length * HEAD_PX
        self.parts.append(
            f'<path d="M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}M{x1 - ux - 0.4 * uy:.1f} {y1 - uy + 0.4 * ux:.1f}'
            f'L{x1:.1f} {y1:.1f}L{x1 - ux + 0.4 * uy:.1f} {y1 - uy - 0.4 * ux:.1f}" fill="none" stroke="{color}" stroke-width="{width}"/>'
        )

    def dot(self, point, color=INK, radius=3.2):
        """A point that counts."""
        x, y = self.at(*point)
        self.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" fill="{color}"/>')

    def word(self, point, text, color=INK, anchor="start", size=14):
        """Words next to a point."""
        x, y = self.at(*point)
        self.parts.append(
            f'<text x="{x:.1f}" y="{y:.1f}" fill="{color}" font-size="{size}" text-anchor="{anchor}">{escape(text)}</text>'
        )

    def text(self):
        """The drawing as a file."""
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width} {self.height}" width="{self.width}" '
            f'height="{self.height}" font-family="sans-serif">\n<rect width="100%" height="100%" fill="white" rx="6"/>\n'
        )
        return head + "\n".join(self.parts) + "\n</svg>\n"
