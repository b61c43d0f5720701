# French sentences about a route; see en.ftl for the variables.

limb = { $limb ->
    [left_hand] Main gauche
    [right_hand] Main droite
    [left_foot] Pied gauche
   *[right_foot] Pied droit
}
limb-short = { $limb ->
    [left_hand] Gauche
    [right_hand] Droite
    [left_foot] Pied gauche
   *[right_foot] Pied droit
}
origin = { $origin ->
    [left_hand] depuis la main gauche
    [right_hand] depuis la main droite
    [left_foot] depuis le pied gauche
   *[right_foot] depuis le pied droit
}
type = { $type ->
    [jug] bac
    [rail] rail
    [edge] bord
    [pocket] trou
    [pinch] pince
    [crimp] réglette
    [sloper] plat
    [volume] volume
    [foothold] prise de pied
   *[unknown] prise
}
sized = { $size ->
    [small] { $type ->
        [jug] petit bac
        [rail] petit rail
        [edge] petit bord
        [pocket] petit trou
        [pinch] petite pince
        [crimp] petite réglette
        [sloper] petit plat
        [volume] petit volume
        [foothold] petite prise de pied
       *[unknown] petite prise
    }
    [large] { $type ->
        [jug] grand bac
        [rail] grand rail
        [edge] grand bord
        [pocket] grand trou
        [pinch] grande pince
        [crimp] grande réglette
        [sloper] grand plat
        [volume] grand volume
        [foothold] grande prise de pied
       *[unknown] grande prise
    }
   *[medium] { type }
}
type-on = { $type ->
    [jug] sur le bac
    [rail] sur le rail
    [edge] sur le bord
    [pocket] dans le trou
    [pinch] sur la pince
    [crimp] sur la réglette
    [sloper] sur le plat
    [volume] sur le volume
    [foothold] sur la prise de pied
   *[unknown] sur la prise
}
clock = { $clock ->
    [0] juste à côté
    [1] à 1 heure
   *[other] à { $clock } heures
}
distance = { $unit ->
    [hands] { $distance ->
        [one] { $distance } largeur de main
       *[other] { $distance } largeurs de main
    }
   *[centimetres] { $distance ->
        [one] { $distance } centimètre
       *[other] { $distance } centimètres
    }
}
apart = { $unit ->
    [hands] { $apart ->
        [one] { $apart } largeur de main d’écart
       *[other] { $apart } largeurs de main d’écart
    }
   *[centimetres] { $apart ->
        [one] { $apart } centimètre d’écart
       *[other] { $apart } centimètres d’écart
    }
}
height = { $height ->
    [one] à { $height } mètre du sol
   *[other] à { $height } mètres du sol
}
wall = { $wall ->
    [slab] { $steepness ->
        [one] en dalle de { $steepness } degré
       *[other] en dalle de { $steepness } degrés
    }
    [overhang] { $steepness ->
        [one] en dévers de { $steepness } degré
       *[other] en dévers de { $steepness } degrés
    }
   *[vertical] vertical
}
hands = { $hands ->
    [one] { $hands } prise de main
   *[other] { $hands } prises de main
}
moves = { $moves ->
    [one] { $moves } mouvement de main
   *[other] { $moves } mouvements de main
}

route = { $name } : { hands }, { moves }, sommet { height }, { wall }.
route-short = { $name } : { moves }.
start = Départ. { limb } : { type }, { height }.
start-short = Départ. { limb-short } : { type }, { height }.
start-full = Départ. { limb } : { sized }, { height }.
start_other = { limb } : { type }, { height }, { apart }.
start_other-full = { limb } : { sized }, { height }, { apart }.
start_with_both = Départ : les deux mains { type-on }, { height }.
start_foot = { limb } : { type }, { height }.
start_foot-full = { limb } : { sized }, { height }.
steepness = Le mur est maintenant { wall }.
hand = { limb } : { clock }, { distance }, { type }.
hand-short = { limb-short } : { clock }, { distance }.
hand_from_other = { limb } : { clock }, { distance } { origin }, { type }.
hand_from_other-short = { limb-short } : { clock }, { distance } { origin }.
hand_from_other-full = { limb } : { clock }, { distance } { origin }, { sized }, { height }.
hand-full = { limb } : { clock }, { distance }, { sized }, { height }.
match = { limb } : sur la prise de l’autre main.
jump = Jeté ! { limb } : { clock }, { distance }, { type }.
jump-short = Jeté ! { limb-short } : { clock }, { distance }.
jump_from_other = Jeté ! { limb } : { clock }, { distance } { origin }, { type }.
jump_from_other-short = Jeté ! { limb-short } : { clock }, { distance } { origin }.
jump_from_other-full = Jeté ! { limb } : { clock }, { distance } { origin }, { sized }, { height }.
jump-full = Jeté ! { limb } : { clock }, { distance }, { sized }, { height }.
foot = { limb } : { clock }, { distance }, { type }.
foot_from_other = { limb } : { clock }, { distance } { origin }, { type }.
foot_from_other-full = { limb } : { clock }, { distance } { origin }, { sized }, { height }.
foot-full = { limb } : { clock }, { distance }, { sized }, { height }.
foot_off = { limb } : dans le vide.
top = Sommet : { type }, { height }.
top-full = Sommet : { sized }, { height }.
out_of_reach = La prise suivante est hors de portée pour cette taille.
