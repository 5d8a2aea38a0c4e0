:- module(planner_durations,
          [ one_step/3,                 % +Head, -Duration, +Situation
            milliseconds/4,             % +Head, +Duration, -Milliseconds, +Situation
            measured/5,                 % +Head, +Stated, -Once, -Odds, +Situation
            least_time/5,               % +Head, +Way, +Stated, -Milliseconds, +Situation
            may_take/5,                 % +Head, +Stated, -Once, -Odds, +Situation
            standing/4,                 % +Head, +Robot, -Place, +Situation
            takes_there/5,              % +Head, +Where, +Stated, -Once-Odds, +Situation
            expected/3                  % +Milliseconds, +Odds, -Milliseconds
          ]).

/** <module> How long actions are expected to take

What is stated of a process, or learned of it, holds for all robots and places. Where a robot was measured to
differ, or a robot at a place, learned/6 says so and stands in for it: the place is the location that the
process names, or else where its first robot is.
*/

:- use_module(library(lists)).
:- use_module(kb_rules(facts), [agent/3, duration/3, learned/6, odds/3, takes_place/3]).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(travel)).

%!  one_step(+Head, -Duration, +Situation) is semidet.
%
%   True if Head is one durative step: a primitive action, or, looking ahead, a composite process with
%   a duration model.

one_step(Head, Duration, S) :-
    revision(S, Revision),
    duration(Revision, Head, Duration),
    !,
    (   Duration = fixed(_) -> true ; ahead(S, _) ).

%!  milliseconds(+Head, +Duration, -Milliseconds, +Situation) is semidet.
%
%   How long a process is expected to take, done again until it succeeds. Fails where there is no way.

milliseconds(Head, fixed(Stated), Milliseconds, S) :- !,
    measured(Head, Stated, Once, Odds, S),
    expected(Once, Odds, Milliseconds).
milliseconds(Head, travel(Robot, To, Stated), Milliseconds, S) :-
    ahead(S, Travel),
    ( set_value(locatedAt, Robot, From, S) -> true ; From = here ),
    travel_time(Travel, Robot, From, To, Way), !,
    measured(Head, Stated, Once, Odds, S),
    expected(Way, Odds, On_the_way),
    expected(Once, Odds, More),
    Milliseconds is On_the_way + More.

%!  measured(+Head, +Stated, -Once, -Odds, +Situation) is det.
%
%   How long one try takes, besides the way, and how likely it succeeds, in this situation.

measured(Head, Stated, Once, Odds, S) :-
    (   first_robot(Head, Robot, S)
    ->  ( standing(Head, Robot, Place, S) -> Where = at(Place) ; Where = nowhere ),
        takes_there(Head, Where, Stated, Once-Odds, S)
    ;   generally(Head, Stated, Once, Odds, S)
    ).

%   The first robot of a process of which something was learned for a robot.
first_robot(Head, Robot, S) :-
    revision(S, Revision),
    functor(Head, Name, _),
    \+ \+ learned(Revision, Name, _, _, _, _),
    agent(Revision, Head, Robot), !.

%!  standing(+Head, +Robot, -Place, +Situation) is semidet.
%
%   The place of the process Head, as far as it is known: the location that it names, or where its Robot is.

standing(Head, Robot, Place, S) :-
    revision(S, Revision),
    (   takes_place(Revision, Head, Place)
    ->  true
    ;   fluent_value(locatedAt, Robot, Place, S)
    ), !.

%!  takes_there(+Head, +Where, +Stated, -Measured, +Situation) is det.
%
%   Measured is Once-Odds where the process is, at(Place) or `nowhere` that we know of: of the robot there, else of the
%   robot, else of the process.

takes_there(Head, Where, Stated, Once-Odds, S) :-
    revision(S, Revision),
    functor(Head, Name, _),
    (   first_robot(Head, Robot, S),
        ( Known = Where ; Known = anywhere ),
        learned(Revision, Name, Robot, Known, Once0, Odds0)
    ->  Once = Once0, Odds = Odds0
    ;   generally(Head, Stated, Once, Odds, S)
    ).

generally(Head, Once, Once, Odds, S) :-
    revision(S, Revision),
    functor(Head, Name, _),
    (   odds(Revision, Name, Known) -> Odds = Known ; Odds = 1 ).

%!  may_take(+Head, +Stated, -Once, -Odds, +Situation) is nondet.
%
%   The same for every place at which the process may be by then: what bounds are made of. One solution if
%   nothing was learned of places, or the process names its own.

may_take(Head, Stated, Once, Odds, S) :-
    (   first_robot(Head, Robot, S)
    ->  revision(S, Revision),
        functor(Head, Name, _),
        (   takes_place(Revision, Head, Place), atom(Place)
        ->  takes_there(Head, at(Place), Stated, Once-Odds, S)
        ;   takes_there(Head, nowhere, Stated, Once-Odds, S)
        ;   learned(Revision, Name, Robot, at(_), Once, Odds)
        )
    ;   generally(Head, Stated, Once, Odds, S)
    ).

%!  least_time(+Head, +Way, +Stated, -Milliseconds, +Situation) is det.
%
%   How long a process takes at least that has such a way to go, wherever it is by then.

least_time(Head, Way, Stated, Milliseconds, S) :-
    findall(Ms,
            ( may_take(Head, Stated, Once, Odds, S),
              expected(Way, Odds, On_the_way), expected(Once, Odds, More), Ms is On_the_way + More ),
            Times),
    min_list(Times, Milliseconds).

%!  expected(+Milliseconds, +Odds, -Milliseconds) is det.
%
%   The mean of what it takes until it succeeds, tries being independent: the geometric distribution's
%   1/Odds tries. Rounded half to even, as Python does.

expected(Once, Odds, Milliseconds) :-
    (   Odds =:= 1
    ->  Milliseconds = Once
    ;   Exact is Once / float(Odds),
        Down is floor(Exact),
        Half is Exact - Down,
        (   ( Half > 0.5 ; Half =:= 0.5, Down mod 2 =:= 1 )
        ->  Milliseconds is Down + 1
        ;   Milliseconds = Down
        )
    ).
