:- module(planner_alike,
          [ alike/4,                    % +Program, +Names, +Situation, -Groups
            grouped/3                   % +Individuals, +Groups, -Groups
          ]).

/** <module> Robots that a program does not tell apart
*/

:- use_module(library(lists)).
:- use_module(library(ordsets)).
:- use_module(library(pairs)).
:- use_module(library(occurs), [sub_term/2]).
:- use_module(kb_rules(facts), [fluent/4, kind/3, learned/6, parameter/4, requires/3]).
:- use_module(planner_golog(influence)).
:- use_module(planner_golog(projection)).

%!  alike(+Program, +Names, +Situation, -Groups) is det.
%
%   The robots, in groups of those that neither a class that Program and the processes Names ask for, nor a
%   condition in them, nor what was learned of them tells apart, nor whether they answer. One that is named
%   where a robot is still to be picked is like no other: it may be the one that is picked, and is there all
%   the same.

alike(P, Names, S, Groups) :-
    revision(S, Revision),
    findall(R, kind(Revision, R, 'Robot'), Robots0),
    sort(Robots0, Robots),
    findall(Property,
            ( program_part(P, Names, S, Part), asks(Part, S, Property, X), maybe_robot(X, S) ),
            Properties0),
    sort(Properties0, Properties),
    findall(Class, ( program_part(P, Names, S, Part), tells_apart(Part, Class) ; asked_of(Revision, Names, Class) ),
            Classes0),
    sort(Classes0, Classes),
    findall(R, ( program_part(P, Names, S, Part), mentioned(Part, R), memberchk(R, Robots) ), Mentioned),
    findall(Signature-R,
            ( member(R, Robots),
              ( memberchk(R, Mentioned) -> Signature = R ; signature(Revision, Classes, Properties, Names, S, R, Signature) ) ),
            Pairs0),
    keysort(Pairs0, Pairs),
    group_pairs_by_key(Pairs, Keyed),
    pairs_values(Keyed, Groups0),
    sort(Groups0, Groups).

%   The classes that a program asks its individuals for.
tells_apart(Part, Class) :-
    sub_term(T, Part),
    nonvar(T),
    (   T = pick(_, _, _, Class, _)
    ;   T = is_a(_, Class)
    ;   ( T = foreach(_, _, Vars, _, _, _) ; T = interrupt(_, _, Vars, _, _) ; T = some(Vars, _) ),
        member(Typed, Vars), nonvar(Typed), Typed = _-Class
    ).

mentioned(Part, R) :-
    (   Part = part(_, Term)
    ->  true
    ;   sub_term(Pick, Part), nonvar(Pick), Pick = pick(_, _, _, _, Term)
    ),
    sub_term(R, Term),
    atom(R).

asked_of(Revision, Names, Class) :-
    member(Name, Names),
    (   requires(Revision, Name, Class)
    ;   parameter(Revision, Head, _, Class), functor(Head, Name, _)
    ).

signature(Revision, Classes, Properties, Names, S, R, signature(Reachable, Kinds, Values, Learned, Places)) :-
    ( fluent(Revision, isReachable, R, false) -> Reachable = false ; Reachable = true ),
    findall(Class, ( member(Class, Classes), kind(Revision, R, Class) ), Kinds0),
    sort(Kinds0, Kinds),
    findall(P-V, ( member(P, Properties), fluent_value(P, R, V, S) ), Values0),
    sort(Values0, Values),
    findall(l(Name, Where, Ms, Odds), ( learned(Revision, Name, R, Where, Ms, Odds), memberchk(Name, Names) ), Learned0),
    sort(Learned0, Learned),
    ( memberchk(l(_, at(_), _, _), Learned) -> findall(P, fluent_value(locatedAt, R, P, S), Places) ; Places = [] ).

maybe_robot(X, S) :-
    ( var(X) -> true ; revision(S, Revision), kind(Revision, X, 'Robot') ).

%!  grouped(+Individuals:ordset, +Groups, -Groups) is det.
%
%   Individuals that are in one group stay together; every other is a group of its own.

grouped(Xs, Groups, Grouped) :-
    findall(Common, ( member(Group, Groups), ord_intersection(Group, Xs, Common), Common \== [] ), Together),
    append(Together, Robots0),
    sort(Robots0, Robots),
    ord_subtract(Xs, Robots, Others),
    findall([X], member(X, Others), Alone),
    append(Together, Alone, Grouped).
