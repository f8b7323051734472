from .viewer import viewed as viewed
